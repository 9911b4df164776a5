//! A caller's pointers into slices and values, after every check that their bits allow.
//!
//! Nothing is written before all checks of a call have passed, so an error leaves the caller's memory as it was.

use core::marker::PhantomData;
use core::ops::Range;

use epipole::nalgebra::SVector;

use crate::Status;

/// Types of plain numbers: any bits are a value, and C sees the same layout.
///
/// # Safety
/// As said, without exception.
pub(crate) unsafe trait Plain: Copy {}

// SAFETY: numbers.
unsafe impl Plain for f32 {}
// SAFETY: numbers.
unsafe impl Plain for f64 {}
// SAFETY: numbers.
unsafe impl Plain for u8 {}
// SAFETY: numbers.
unsafe impl Plain for u32 {}
// SAFETY: an address; it is written, never read.
unsafe impl<T> Plain for *mut T {}
// SAFETY: an array has no bits but those of its elements.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}
// SAFETY: `repr(C)` over a transparent array of N numbers.
unsafe impl<T: Plain, const N: usize> Plain for SVector<T, N> {}

const _: () = {
    assert!(size_of::<SVector<f32, 2>>() == 8 && align_of::<SVector<f32, 2>>() == align_of::<f32>());
    assert!(size_of::<SVector<f64, 3>>() == 24 && align_of::<SVector<f64, 3>>() == align_of::<f64>());
};

/// The addresses of some memory.
pub(crate) type Bytes = Range<usize>;

/// The addresses of `count` elements, which could be a slice.
pub(crate) fn bytes_of<V>(pointer: *const V, count: usize) -> Result<Bytes, Status> {
    bytes_at(pointer.addr(), count, size_of::<V>(), align_of::<V>())
}

/// The same for any type.
fn bytes_at(start: usize, count: usize, size: usize, align: usize) -> Result<Bytes, Status> {
    if start == 0 {
        return Err(Status::NullPointer);
    }
    // `align` is a power of two: no division, for which a Cortex-M0 has no instruction.
    if start & align.wrapping_sub(1) != 0 {
        return Err(Status::Misaligned);
    }
    let size = count.checked_mul(size).filter(|&size| size <= isize::MAX as usize);
    let end = size.and_then(|size| start.checked_add(size)).ok_or(Status::TooLarge)?;
    Ok(start..end)
}

/// An array that the caller lends for reading.
#[derive(Clone, Copy)]
pub(crate) struct Input<'a, V> {
    pub(crate) slice: &'a [V],
}

impl<'a, V: Plain> Input<'a, V> {
    /// `count` elements of `V`, given as its numbers.
    ///
    /// # Safety
    /// A pointer that is not null points to as many elements, which nobody writes for `'a`.
    pub(crate) unsafe fn new<S>(pointer: *const S, count: usize) -> Result<Self, Status> {
        let pointer = pointer.cast::<V>();
        bytes_of(pointer, count)?;
        // SAFETY: not null, aligned, of a possible size; the rest is the caller's promise.
        Ok(Self { slice: unsafe { core::slice::from_raw_parts(pointer, count) } })
    }

    /// None for a null pointer, where the function has a meaning for it.
    ///
    /// # Safety
    /// As [`new`](Self::new).
    pub(crate) unsafe fn nullable<S>(pointer: *const S, count: usize) -> Result<Option<Self>, Status> {
        if pointer.is_null() {
            return Ok(None);
        }
        // SAFETY: passed on.
        unsafe { Self::new(pointer, count).map(Some) }
    }

    pub(crate) fn bytes(&self) -> Bytes {
        let range = self.slice.as_ptr_range();
        range.start.addr()..range.end.addr()
    }

    /// The array of its elements.
    pub(crate) fn array<const N: usize>(&self) -> Result<&'a [V; N], Status> {
        self.slice.try_into().map_err(|_| Status::TooFew)
    }

    /// The first element.
    pub(crate) fn value(&self) -> Result<V, Status> {
        self.slice.first().copied().ok_or(Status::TooFew)
    }
}

/// An array that the caller lends for writing. It is not read, and may be uninitialised.
pub(crate) struct Output<'a, V> {
    pointer: *mut V,
    capacity: usize,
    written: usize,
    bytes: Bytes,
    lent: PhantomData<&'a mut V>,
}

impl<V: Plain> Output<'_, V> {
    /// `capacity` elements of `V`, given as its numbers.
    ///
    /// # Safety
    /// A pointer that is not null points to memory for as many elements, which nobody else uses for the lifetime.
    pub(crate) unsafe fn new<S>(pointer: *mut S, capacity: usize) -> Result<Self, Status> {
        let pointer = pointer.cast::<V>();
        let bytes = bytes_of(pointer, capacity)?;
        Ok(Self { pointer, capacity, written: 0, bytes, lent: PhantomData })
    }

    pub(crate) fn bytes(&self) -> Bytes {
        self.bytes.clone()
    }

    /// An error where fewer than `most` elements would fit.
    pub(crate) fn holding(&self, most: usize) -> Result<(), Status> {
        if self.capacity < most { Err(Status::Capacity) } else { Ok(()) }
    }

    /// Writes the next element; nothing beyond the last.
    pub(crate) fn push(&mut self, value: V) {
        if self.written < self.capacity {
            // SAFETY: below the capacity, of memory that is ours to write.
            unsafe { self.pointer.add(self.written).write(value) };
            self.written += 1;
        }
    }

    /// Writes the values that fit, and tells how many were written in all.
    pub(crate) fn write(&mut self, values: impl IntoIterator<Item = V>) -> usize {
        for value in values {
            self.push(value);
        }
        self.written
    }
}

impl<V: Plain> Output<'_, V> {
    /// Writes what there is, `none` where there is nothing, and which it was; tells how many there are.
    pub(crate) fn write_masked(
        &mut self,
        mask: &mut Output<'_, u8>,
        values: impl IntoIterator<Item = Option<V>>,
        none: V,
    ) -> usize {
        let mut found = 0;
        for value in values {
            found += usize::from(value.is_some());
            mask.push(u8::from(value.is_some()));
            self.push(value.unwrap_or(none));
        }
        found
    }
}

/// A struct that may grow from version to version, by fields at its end.
///
/// # Safety
/// `repr(C)` of plain numbers; options begin with their size in bytes, a `u32`.
pub(crate) unsafe trait Grows: Copy {
    /// Its size in the first version.
    const FIRST: usize;

    /// `size`, where a version up to this one has it.
    fn known(size: usize) -> Result<usize, Status> {
        if size >= Self::FIRST && size <= size_of::<Self>() { Ok(size) } else { Err(Status::StructSize) }
    }
}

/// The options at `pointer` over the defaults, which stay for what an older caller does not know, and where they lie.
///
/// # Safety
/// A pointer that is not null points to a struct of the size that its first field says.
pub(crate) unsafe fn read_options<O: Grows>(pointer: *const O, default: O) -> Result<(O, Bytes), Status> {
    bytes_of(pointer, 1)?;
    // SAFETY: not null, aligned; the first field is a `u32`.
    let size = O::known(unsafe { pointer.cast::<u32>().read() } as usize)?;
    let mut options = default;
    // SAFETY: `size` bytes are there, and no more than `O` has; any bits of them are an `O`.
    unsafe { core::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut options).cast::<u8>(), size) };
    Ok((options, bytes_of(pointer.cast::<u8>(), size)?))
}

/// A struct that the caller lends for writing, as large as its version knows it.
pub(crate) struct OutputStruct<'a, E> {
    pointer: *mut E,
    size: usize,
    bytes: Bytes,
    lent: PhantomData<&'a mut E>,
}

impl<E: Grows> OutputStruct<'_, E> {
    /// # Safety
    /// A pointer that is not null points to `size` bytes, which nobody else uses for the lifetime.
    pub(crate) unsafe fn new(pointer: *mut E, size: usize) -> Result<Self, Status> {
        bytes_of(pointer, 1)?;
        let size = E::known(size)?;
        Ok(Self { pointer, size, bytes: bytes_of(pointer.cast::<u8>(), size)?, lent: PhantomData })
    }

    pub(crate) fn bytes(&self) -> Bytes {
        self.bytes.clone()
    }

    /// Writes as much of the value as the caller's version has.
    pub(crate) fn write(&mut self, value: &E) {
        let from = (&raw const *value).cast::<u8>();
        // SAFETY: `size` bytes are ours to write, and `E` has no fewer.
        unsafe { core::ptr::copy_nonoverlapping(from, self.pointer.cast::<u8>(), self.size) };
    }
}

/// No output overlaps an input or another output.
pub(crate) fn disjoint(inputs: &[Bytes], outputs: &[Bytes]) -> Result<(), Status> {
    let overlap = |a: &Bytes, b: &Bytes| !a.is_empty() && !b.is_empty() && a.start < b.end && b.start < a.end;
    let mut rest = outputs.iter();
    while let Some(output) = rest.next() {
        if inputs.iter().chain(rest.clone()).any(|other| overlap(output, other)) {
            return Err(Status::Overlap);
        }
    }
    Ok(())
}

/// Arguments of a function as inputs and outputs of the same names, after the checks of their pointers.
macro_rules! lend {
    (in { $($input:ident: [$read:ty; $count:expr]),* $(,)? } out { $($output:ident: [$write:ty; $capacity:expr]),* $(,)? }) => {
        // SAFETY: the caller's promise, which every function of `api` documents.
        #[allow(unused_unsafe, clippy::unused_unit)]
        let ($($input,)*) = unsafe { ($($crate::raw::Input::<$read>::new($input, $count)?,)*) };
        // SAFETY: the same.
        #[allow(unused_unsafe, clippy::unused_unit)]
        let ($(mut $output,)*) = unsafe { ($($crate::raw::Output::<$write>::new($output, $capacity)?,)*) };
        $crate::raw::disjoint(&[$($input.bytes()),*], &[$($output.bytes()),*])?;
    };
}
pub(crate) use lend;

#[cfg(test)]
mod tests {
    use super::*;

    /// A struct of a second version, of which the first had two fields.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    struct Grown {
        size: u32,
        old: u32,
        new: u32,
    }
    // SAFETY: numbers that begin with the size.
    unsafe impl Grows for Grown {
        const FIRST: usize = 8;
    }
    const DEFAULT: Grown = Grown { size: 12, old: 1, new: 2 };

    #[test]
    fn an_older_caller_gets_defaults_for_what_it_does_not_know() {
        // SAFETY: as long as its first number says.
        let (read, bytes) = unsafe { read_options([8u32, 7].as_ptr().cast::<Grown>(), DEFAULT) }.unwrap();
        assert_eq!((read.old, read.new, bytes.len()), (7, 2, 8));
        let whole = Grown { size: 12, old: 7, new: 9 };
        // SAFETY: as long as its first number says.
        assert_eq!(unsafe { read_options(&whole, DEFAULT) }.unwrap().0, whole);
        for size in [0u32, 7, 13, 16, u32::MAX] {
            // SAFETY: no more than the first number is read.
            let read = unsafe { read_options([size, 7, 0, 0].as_ptr().cast::<Grown>(), DEFAULT) };
            assert_eq!(read.unwrap_err(), Status::StructSize);
        }
    }

    #[test]
    fn an_older_caller_is_written_what_it_knows() {
        let mut memory = [5u32; 3];
        // SAFETY: eight bytes are there.
        unsafe { OutputStruct::new(memory.as_mut_ptr().cast::<Grown>(), 8) }.unwrap().write(&DEFAULT);
        assert_eq!(memory, [12, 1, 5]);
    }

    #[test]
    fn outputs_overlap_nothing() {
        assert_eq!(disjoint(&[0..4, 8..12], &[4..8, 12..20]), Ok(()));
        assert_eq!(disjoint(&[9..10, 0..4], &[3..8, 20..21]), Err(Status::Overlap));
        assert_eq!(disjoint(&[], &[0..4, 10..12, 3..5]), Err(Status::Overlap));
        assert_eq!(disjoint(&[0..8, 2..4], &[]), Ok(()));
    }

    #[test]
    fn an_output_stops_at_its_end() {
        let mut memory = [0u32; 3];
        // SAFETY: two of the three.
        let mut output = unsafe { Output::<u32>::new(memory.as_mut_ptr(), 2) }.unwrap();
        assert_eq!(output.write([7, 8, 9]), 2);
        assert_eq!((output.holding(2), output.holding(3)), (Ok(()), Err(Status::Capacity)));
        assert_eq!(memory, [7, 8, 0]);
    }
}
