//! Memory that two processes share, through which one sends requests and the other answers.
//!
//! A waiting process first looks at the memory for about a millisecond, and yields the processor in
//! between: an answer comes faster than the system wakes a process.

#![allow(unsafe_code)]

use memmap2::{MmapOptions, MmapRaw};
use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Largest number of bytes of a message.
pub(crate) const LARGEST: usize = 1 << 20;
/// Number of bytes before the messages.
const HEAD: usize = 4096;
/// Number of bytes of the memory: two messages, and the last words.
const SIZE: usize = HEAD + 3 * LARGEST;
/// Distance between counters, so that the two processes do not write to one line of the cache.
const LINE: usize = 128;
/// Time for which a process looks at the memory before it sleeps.
const SPIN_TIME: Duration = Duration::from_millis(1);
/// Time after which a sleeping process looks whether the other one is still there.
const SLEEP_TIME: Duration = Duration::from_millis(20);

/// Place of a message in the memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    Request = 0,
    Reply = 1,
    /// Last message of the instance about a problem, which is read when its process has ended.
    LastMessage = 2,
}

/// One end of the memory.
pub(crate) struct Channel {
    map: MmapRaw,
}

impl Channel {
    /// Makes the memory in a new file.
    pub(crate) fn create(file: &File) -> io::Result<Self> {
        file.set_len(SIZE as u64)?;
        Self::open(file)
    }

    /// Opens the memory that the other process made.
    pub(crate) fn open(file: &File) -> io::Result<Self> {
        if file.metadata()?.len() != SIZE as u64 {
            return Err(io::Error::other("the shared memory is not as large as it should be"));
        }
        Ok(Self { map: MmapOptions::new().len(SIZE).map_raw(file)? })
    }

    /// The counters of a slot: number of the message, length, and whether a process sleeps.
    fn counter(&self, slot: Slot, which: usize) -> &AtomicU32 {
        let offset = (3 * slot as usize + which) * LINE;
        // SAFETY: the offset is a multiple of the alignment and less than HEAD, the map begins at
        // a page and lives as long as `self`, and both processes use the place as an atomic only.
        unsafe { AtomicU32::from_ptr(self.map.as_mut_ptr().add(offset).cast()) }
    }

    fn content(&self, slot: Slot) -> *mut u8 {
        // SAFETY: the offset plus LARGEST is at most SIZE, the length of the map.
        unsafe { self.map.as_mut_ptr().add(HEAD + slot as usize * LARGEST) }
    }

    /// Writes the message with this number. It must not be longer than [`LARGEST`].
    pub(crate) fn put(&self, slot: Slot, number: u32, message: &[u8]) {
        assert!(message.len() <= LARGEST, "a message fits into its slot");
        // SAFETY: the slot is as long as the message, which lies elsewhere. The other process reads
        // the slot only after the number was stored, and writes it never.
        unsafe { self.content(slot).copy_from_nonoverlapping(message.as_ptr(), message.len()) };
        self.counter(slot, 1).store(message.len() as u32, Ordering::Relaxed);
        // Sequential consistency: either the sleeper sees the number, or it is seen to sleep.
        self.counter(slot, 0).store(number, Ordering::SeqCst);
        if self.counter(slot, 2).load(Ordering::SeqCst) != 0 {
            wake(self.counter(slot, 0));
        }
    }

    /// Copies the message that lies in a slot into `message`.
    pub(crate) fn copy(&self, slot: Slot, message: &mut Vec<u8>) {
        // A broken process may have written any length.
        let length = (self.counter(slot, 1).load(Ordering::Relaxed) as usize).min(LARGEST);
        message.clear();
        message.reserve(length);
        // SAFETY: both places have room for `length` bytes, which are initialised by the copy. A
        // process that breaks the protocol by writing now gives other bytes, which are decoded as
        // untrusted ones.
        unsafe {
            message.as_mut_ptr().copy_from_nonoverlapping(self.content(slot), length);
            message.set_len(length);
        }
    }

    /// Returns whether the message with this number is there.
    pub(crate) fn has(&self, slot: Slot, number: u32) -> bool {
        self.counter(slot, 0).load(Ordering::SeqCst) == number
    }

    /// Waits for the message with this number. `goes_on` is asked from time to time, with the time
    /// that has passed, and ends the wait by an error.
    pub(crate) fn wait<E>(
        &self,
        slot: Slot,
        number: u32,
        mut goes_on: impl FnMut(Duration) -> Result<(), E>,
    ) -> Result<(), E> {
        let begin = Instant::now();
        loop {
            for _ in 0..64 {
                if self.has(slot, number) {
                    return Ok(());
                }
                std::thread::yield_now();
            }
            if begin.elapsed() > SPIN_TIME {
                break;
            }
        }
        let sleeps = self.counter(slot, 2);
        loop {
            sleeps.store(1, Ordering::SeqCst);
            let there = self.counter(slot, 0).load(Ordering::SeqCst);
            if there != number {
                sleep(self.counter(slot, 0), there);
            }
            sleeps.store(0, Ordering::SeqCst);
            if self.has(slot, number) {
                return Ok(());
            }
            goes_on(begin.elapsed())?;
        }
    }
}

/// Sleeps until the counter is woken, no longer has this value, or a while has passed.
#[cfg(target_os = "linux")]
fn sleep(counter: &AtomicU32, value: u32) {
    use rustix::thread::futex;
    let nap = futex::Timespec { tv_sec: 0, tv_nsec: SLEEP_TIME.as_nanos() as _ };
    // Whatever ended the sleep, the caller looks again.
    let _ = futex::wait(counter, futex::Flags::empty(), value, Some(&nap));
}

#[cfg(target_os = "linux")]
fn wake(counter: &AtomicU32) {
    use rustix::thread::futex;
    // Nobody may be asleep any more.
    let _ = futex::wake(counter, futex::Flags::empty(), 1);
}

/// Other systems wake only threads of the same process: here a sleeper looks often.
#[cfg(not(target_os = "linux"))]
fn sleep(_counter: &AtomicU32, _value: u32) {
    std::thread::sleep(SLEEP_TIME / 100);
}

#[cfg(not(target_os = "linux"))]
fn wake(_counter: &AtomicU32) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_as_they_were_sent_in_order() {
        let file = tempfile::tempfile().unwrap();
        let (asks, answers) = (Channel::create(&file).unwrap(), Channel::open(&file).unwrap());
        let other = std::thread::spawn(move || {
            let mut message = Vec::new();
            for number in 1..=300 {
                answers.wait(Slot::Request, number, |_| Ok::<(), ()>(())).unwrap();
                answers.copy(Slot::Request, &mut message);
                if number % 100 == 0 {
                    std::thread::sleep(3 * SPIN_TIME);
                }
                message.reverse();
                answers.put(Slot::Reply, number, &message);
            }
        });
        let mut reply = Vec::new();
        for number in 1..=300_u32 {
            let message: Vec<u8> = number.to_le_bytes().repeat(number as usize);
            asks.put(Slot::Request, number, &message);
            asks.wait(Slot::Reply, number, |_| Ok::<(), ()>(())).unwrap();
            asks.copy(Slot::Reply, &mut reply);
            reply.reverse();
            assert_eq!(reply, message);
        }
        other.join().unwrap();
    }

    #[test]
    fn a_wait_can_be_ended_and_a_false_length_is_cut() {
        let file = tempfile::tempfile().unwrap();
        let channel = Channel::create(&file).unwrap();
        let late = |waited| if waited > 3 * SPIN_TIME { Err("late") } else { Ok(()) };
        assert_eq!(channel.wait(Slot::Reply, 1, late), Err("late"));
        channel.put(Slot::Reply, 1, b"four");
        channel.counter(Slot::Reply, 1).store(u32::MAX, Ordering::SeqCst);
        let mut message = Vec::new();
        channel.copy(Slot::Reply, &mut message);
        assert_eq!((message.len(), &message[..4]), (LARGEST, &b"four"[..]));
        file.set_len(100).unwrap();
        assert!(Channel::open(&file).is_err());
    }
}
