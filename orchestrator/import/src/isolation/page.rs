//! The calls that the threads of a closed process are making, in memory that its supervisor sees as
//! well. When the process has ended, or no longer answers, this names the instance and the call.

#![allow(unsafe_code)]

use parking_lot::Mutex;
use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous, munmap};
use std::cell::{Cell, UnsafeCell};
use std::io;
use std::ptr::{NonNull, null_mut};
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, AtomicUsize, Ordering};

/// Number of bytes of a text.
const LENGTH: usize = 500;
/// Largest number of threads that are told apart.
pub(super) const SLOTS: usize = 64;

/// A text that ends with a zero.
struct Text(UnsafeCell<[u8; LENGTH]>);

impl Text {
    /// Writes a text. It must not be written by several threads at a time.
    #[inline]
    fn put(&self, text: &str) {
        let length = text.len().min(LENGTH - 1);
        let place = self.0.get().cast::<u8>();
        // SAFETY: there is room for the length and the zero, and the text lies elsewhere.
        unsafe {
            place.copy_from_nonoverlapping(text.as_ptr(), length);
            place.add(length).write(0);
        }
    }

    fn get(&self) -> String {
        // SAFETY: the text is read as bytes, which may change meanwhile.
        let bytes = unsafe { self.0.get().read_volatile() };
        let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
        // Nothing that could change the terminal.
        String::from_utf8_lossy(text).replace(char::is_control, " ")
    }
}

/// What a thread does. It is all zero at first.
#[repr(C)]
struct Slot {
    /// Number of calls that were begun, and of those that have returned: it is odd during a call.
    calls: AtomicU64,
    /// Bits of the simulated time, s.
    time: AtomicU64,
    /// Numbers of the case and of the part of the work, plus one.
    case: AtomicU64,
    part: AtomicU64,
    /// Whether the thread ends the process.
    ends: AtomicBool,
    component: Text,
    call: Text,
}

/// The memory, which is zero at first.
#[repr(C)]
struct Content {
    slots: [Slot; SLOTS],
    /// Last message of an instance about a problem.
    words: Text,
}

/// The memory, as the supervisor holds it.
pub(super) struct Page(NonNull<Content>);

// SAFETY: the content is atomic or read as bytes.
unsafe impl Send for Page {}

/// A call that is being made.
pub(super) struct Doing {
    pub(super) component: String,
    pub(super) call: String,
    pub(super) time: f64,
    pub(super) case: Option<u64>,
    pub(super) part: Option<usize>,
}

impl Page {
    pub(super) fn new() -> io::Result<Self> {
        let (access, kind) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
        // SAFETY: the system chooses where the memory lies.
        let place = unsafe { mmap_anonymous(null_mut(), size_of::<Content>(), access, kind)? };
        NonNull::new(place.cast()).map(Self).ok_or_else(|| io::ErrorKind::OutOfMemory.into())
    }

    fn content(&self) -> &Content {
        // SAFETY: the memory is as large as the content, for which zeros are valid, and lives as
        // long as `self`.
        unsafe { self.0.as_ref() }
    }

    /// Lets this process record its calls here.
    pub(super) fn write_here(&self) {
        CURRENT.store(self.0.as_ptr(), Ordering::Release);
    }

    /// Returns the numbers of begun and returned calls of each thread, odd during a call.
    pub(super) fn calls(&self) -> [u64; SLOTS] {
        self.content().slots.each_ref().map(|slot| slot.calls.load(Ordering::Acquire))
    }

    /// Returns the call that has ended the process or is `late`, if it is known.
    pub(super) fn culprit(&self, late: Option<usize>) -> Option<Doing> {
        let slots = &self.content().slots;
        let called: Vec<&Slot> = slots.iter().filter(|slot| slot.is_called()).collect();
        let ends = called.iter().find(|slot| slot.ends.load(Ordering::Relaxed)).copied();
        let only = called.first().copied().filter(|_| called.len() == 1);
        let slot = late.map(|late| &slots[late]).or(ends).or(only)?;
        let number = |number: &AtomicU64| number.load(Ordering::Relaxed).checked_sub(1);
        Some(Doing {
            component: slot.component.get(),
            call: slot.call.get(),
            time: slot.time(),
            case: number(&slot.case),
            part: number(&slot.part).and_then(|part| usize::try_from(part).ok()),
        })
    }

    /// Returns the simulated time of the first thread, s.
    pub(super) fn time(&self) -> f64 {
        self.content().slots[0].time()
    }

    pub(super) fn words(&self) -> String {
        self.content().words.get()
    }
}

impl Slot {
    fn time(&self) -> f64 {
        f64::from_bits(self.time.load(Ordering::Relaxed))
    }

    fn is_called(&self) -> bool {
        self.calls.load(Ordering::Acquire) % 2 == 1
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // SAFETY: this is the memory of `new`, and nothing refers to it any more.
        let _ = unsafe { munmap(self.0.as_ptr().cast(), size_of::<Content>()) };
    }
}

/// The memory in which this process records its calls, if it is closed.
static CURRENT: AtomicPtr<Content> = AtomicPtr::new(null_mut());
/// Number of threads that have a slot.
static THREADS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Slot of this thread, once it has one.
    static OWN: Cell<Option<usize>> = const { Cell::new(None) };
}

fn content() -> Option<&'static Content> {
    // SAFETY: the pointer is null or that of `write_here`, whose memory this process never frees.
    unsafe { CURRENT.load(Ordering::Relaxed).as_ref() }
}

/// Returns the slot of this thread. So many threads that they share one are not expected.
#[inline]
fn own() -> Option<&'static Slot> {
    let content = content()?;
    let place = OWN.get().unwrap_or_else(|| {
        let place = THREADS.fetch_add(1, Ordering::Relaxed) % SLOTS;
        OWN.set(Some(place));
        place
    });
    Some(&content.slots[place])
}

/// Records that a call is made.
#[inline]
pub(crate) fn begin(component: &str, call: &str) {
    if let Some(slot) = own() {
        slot.component.put(component);
        slot.call.put(call);
        slot.calls.fetch_add(1, Ordering::Release);
    }
}

/// Records that the call has returned.
#[inline]
pub(crate) fn end() {
    if let Some(slot) = own() {
        slot.calls.fetch_add(1, Ordering::Release);
    }
}

/// Records that this thread ends the process.
pub(crate) fn ends() {
    if let Some(slot) = own() {
        slot.ends.store(true, Ordering::Relaxed);
    }
}

/// Records a message of an instance about a problem.
pub(crate) fn problem(text: &str) {
    static TURN: Mutex<()> = Mutex::new(());
    if let Some(content) = content() {
        let _turn = TURN.lock();
        content.words.put(text);
    }
}

/// Records the simulated time, s.
pub(crate) fn at(time: f64) {
    if let Some(slot) = own() {
        slot.time.store(time.to_bits(), Ordering::Relaxed);
    }
}

/// Records the case that is flown.
pub(crate) fn in_case(case: Option<u64>) {
    if let Some(slot) = own() {
        slot.case.store(case.map_or(0, |case| case + 1), Ordering::Relaxed);
    }
}

/// Records the part that is worked on.
pub(crate) fn in_part(part: usize) {
    if let Some(slot) = own() {
        slot.part.store(part as u64 + 1, Ordering::Relaxed);
    }
}
