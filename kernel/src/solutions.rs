//! The short list in which a minimal solver returns its solutions.

use core::fmt;
use core::ops::Deref;

/// At most `N` solutions, held in place; a slice to read.
///
/// ```
/// use epipole::Solutions;
/// let none = Solutions::<f32, 4>::new();
/// assert!(none.is_empty());
/// ```
#[derive(Clone)]
#[must_use]
pub struct Solutions<T, const N: usize>(heapless::Vec<T, N>);

impl<T, const N: usize> Solutions<T, N> {
    /// No solution.
    pub const fn new() -> Self {
        Self(heapless::Vec::new())
    }

    /// Adds a solution; false, and nothing changed, where there are `N` already.
    #[inline]
    pub fn push(&mut self, solution: T) -> bool {
        self.0.push(solution).is_ok()
    }

    /// The solutions, in the order in which the solver documents them.
    #[inline]
    pub fn as_slice(&self) -> &[T] {
        self.0.as_slice()
    }
}

impl<T, const N: usize> Default for Solutions<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T, const N: usize> Deref for Solutions<T, N> {
    type Target = [T];
    #[inline]
    fn deref(&self) -> &[T] {
        self.0.as_slice()
    }
}

impl<T: PartialEq, const N: usize> PartialEq for Solutions<T, N> {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl<T: fmt::Debug, const N: usize> fmt::Debug for Solutions<T, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl<'a, T, const N: usize> IntoIterator for &'a Solutions<T, N> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

/// The solutions of a [`Solutions`], one after the other, by value.
pub struct IntoIter<T, const N: usize>(<heapless::Vec<T, N> as IntoIterator>::IntoIter);

impl<T, const N: usize> Iterator for IntoIter<T, N> {
    type Item = T;
    fn next(&mut self) -> Option<T> {
        self.0.next()
    }
}

impl<T, const N: usize> IntoIterator for Solutions<T, N> {
    type Item = T;
    type IntoIter = IntoIter<T, N>;
    fn into_iter(self) -> IntoIter<T, N> {
        IntoIter(self.0.into_iter())
    }
}
