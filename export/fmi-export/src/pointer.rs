//! Pointers of the importer. They are checked here and nowhere else: null, alignment, length and
//! overlap can be seen; that there is memory behind them cannot, and is the importer's promise.
#![allow(unsafe_code)]

use crate::call::{Outcome, error};
use crate::model::Failure;
use std::ffi::{CStr, c_char};
use std::mem::MaybeUninit;

/// Refuses a null pointer.
pub(crate) fn not_null<T>(name: &str, pointer: *const T) -> Outcome {
    if pointer.is_null() { error(format!("argument '{name}' is NULL")) } else { Ok(()) }
}

/// Refuses a pointer that cannot point to `n` values, `n` > 0.
pub(crate) fn check<T>(name: &str, pointer: *const T, n: usize) -> Outcome {
    not_null(name, pointer)?;
    if !pointer.is_aligned() {
        return error(format!(
            "argument '{name}' is at {pointer:p}, which is not aligned to {} bytes",
            align_of::<T>()
        ));
    }
    if n > isize::MAX as usize / size_of::<T>().max(1) {
        return error(format!("argument '{name}' cannot have {n} elements"));
    }
    Ok(())
}

/// Returns the `n` values at `pointer`, which may be null if `n` is 0. The caller promises that
/// they are initialized and do not change during the call.
pub(crate) unsafe fn slice<'a, T>(
    name: &str,
    pointer: *const T,
    n: usize,
) -> Result<&'a [T], Failure> {
    if n == 0 {
        return Ok(&[]);
    }
    check(name, pointer, n)?;
    // SAFETY: `check` refused null, wrong alignment and lengths beyond `isize::MAX` bytes; the
    // importer vouches for n initialized elements that do not change during the call.
    Ok(unsafe { std::slice::from_raw_parts(pointer, n) })
}

/// Room for the results of a call. The importer need not have initialized it, and it keeps its
/// content until a result is put.
pub(crate) struct Room<'a, T>(&'a mut [MaybeUninit<T>]);

impl<'a, T: Copy + Default> Room<'a, T> {
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Puts the result with that position.
    pub(crate) fn put(&mut self, position: usize, value: T) {
        self.0[position].write(value);
    }

    /// Puts as many results as there are places.
    pub(crate) fn fill(&mut self, values: impl IntoIterator<Item = T>) {
        for (place, value) in self.0.iter_mut().zip(values) {
            place.write(value);
        }
    }

    /// Returns the room with zeros in it, for results that are written by others.
    pub(crate) fn zeroed(self) -> &'a mut [T] {
        for place in &mut *self.0 {
            place.write(T::default());
        }
        // SAFETY: each place was just written, and MaybeUninit<T> has the layout of T.
        unsafe { &mut *(std::ptr::from_mut(self.0) as *mut [T]) }
    }
}

/// Returns the room for `n` values at `pointer`, which may be null if `n` is 0. The caller promises
/// that nobody else uses it during the call.
pub(crate) unsafe fn room<'a, T>(
    name: &str,
    pointer: *mut T,
    n: usize,
) -> Result<Room<'a, T>, Failure> {
    if n == 0 {
        return Ok(Room(&mut []));
    }
    check(name, pointer, n)?;
    // SAFETY: `check` refused null, wrong alignment and lengths beyond `isize::MAX` bytes; the
    // importer vouches for room for n elements that nobody else uses during the call. MaybeUninit
    // requires nothing of the content.
    Ok(Room(unsafe { std::slice::from_raw_parts_mut(pointer.cast(), n) }))
}

/// Refuses room for results that overlaps the data that the same call reads: two references to it
/// must not live at the same time.
pub(crate) fn apart<T, U>(
    read: (&str, *const T, usize),
    written: (&str, *mut U, usize),
) -> Outcome {
    let end = |address: usize, n: usize, size| address.saturating_add(n.saturating_mul(size));
    let (from, to) = (read.1.addr(), written.1.addr());
    let overlaps =
        from < end(to, written.2, size_of::<U>()) && to < end(from, read.2, size_of::<T>());
    if overlaps {
        return error(format!("arguments '{}' and '{}' overlap", read.0, written.0));
    }
    Ok(())
}

/// Returns the value references of a call that gets values, with the room for the values. The
/// caller fulfils the conditions of [`slice`] and [`room`].
pub(crate) unsafe fn requested<'a, T>(
    vr: *const u32,
    n: usize,
    value: *mut T,
) -> Result<(&'a [u32], Room<'a, T>), Failure> {
    // SAFETY: the caller promises what `slice` asks.
    let references = unsafe { slice("vr", vr, n) }?;
    apart(("vr", vr, n), ("value", value, n))?;
    // SAFETY: the caller promises what `room` asks, and the arrays do not overlap.
    Ok((references, unsafe { room("value", value, n) }?))
}

/// Writes the single result of a call to `pointer`. The caller promises that it is null or points
/// to room for one value.
pub(crate) unsafe fn put<T>(name: &str, pointer: *mut T, value: T) -> Outcome {
    check(name, pointer, 1)?;
    // SAFETY: `check` refused null and wrong alignment, and the importer vouches for room for one
    // value. The write does not read the old content, which may be uninitialized.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Reads a text of the importer. The caller promises that `pointer` is null or a NUL-terminated
/// text that lives during the call.
pub(crate) unsafe fn text<'a>(name: &str, pointer: *const c_char) -> Result<&'a str, String> {
    if pointer.is_null() {
        return Err(format!("argument '{name}' is NULL"));
    }
    // SAFETY: null was refused above, so by the importer's promise the text is NUL-terminated and
    // lives unchanged during the call.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| format!("'{}' is not UTF-8", text.to_string_lossy()))
}
