//! Where the loops read and write: a plain address. In this crate's own tests it also knows its bounds, and
//! every access of the same loops is checked against them.

use std::ptr::NonNull;

use super::lanes::Lanes;

/// A place in a slice of floats.
#[derive(Clone, Copy)]
pub(super) struct Pointer {
    #[cfg(test)]
    bounds: Bounds,
    at: NonNull<f32>,
}

impl Pointer {
    /// The first of these floats, to be read.
    pub(super) fn to(floats: &[f32]) -> Self {
        Self {
            #[cfg(test)]
            bounds: Bounds { offset: 0, len: floats.len(), writable: false },
            at: NonNull::from(floats).cast(),
        }
    }

    /// The first of these floats, to be read and written.
    pub(super) fn to_mut(floats: &mut [f32]) -> Self {
        Self {
            #[cfg(test)]
            bounds: Bounds { offset: 0, len: floats.len(), writable: true },
            at: NonNull::from(floats).cast(),
        }
    }

    /// # Safety
    ///
    /// There are `count` floats from here on.
    #[inline(always)]
    pub(super) unsafe fn add(self, count: usize) -> Self {
        Self {
            #[cfg(test)]
            bounds: self.bounds.after(count),
            // SAFETY: the caller's promise.
            at: unsafe { self.at.add(count) },
        }
    }

    /// # Safety
    ///
    /// There is a float here.
    #[inline(always)]
    pub(super) unsafe fn get(self) -> f32 {
        #[cfg(test)]
        self.bounds.check(1);
        // SAFETY: the caller's promise.
        unsafe { self.at.read() }
    }

    /// # Safety
    ///
    /// There are `L::WIDTH` floats from here on, and the CPU has the features of `L`.
    #[inline(always)]
    pub(super) unsafe fn load<L: Lanes>(self) -> L {
        #[cfg(test)]
        self.bounds.check(L::WIDTH);
        // SAFETY: the caller's promise.
        unsafe { L::load(self.at.as_ptr()) }
    }

    /// # Safety
    ///
    /// As [`Pointer::load`], and the floats may be written.
    #[inline(always)]
    pub(super) unsafe fn store<L: Lanes>(self, value: L) {
        #[cfg(test)]
        self.bounds.check_written(L::WIDTH);
        // SAFETY: the caller's promise.
        unsafe { value.store(self.at.as_ptr()) }
    }

    /// [`Lanes::transpose`] from here.
    ///
    /// # Safety
    ///
    /// There are `L::WIDTH` rows of `L::WIDTH` floats here and at `to`, which may be written, at their strides;
    /// the CPU has the features of `L`.
    #[inline(always)]
    pub(super) unsafe fn transpose<L: Lanes>(self, stride: usize, to: Self, to_stride: usize) {
        #[cfg(test)]
        for row in 0..L::WIDTH {
            self.bounds.after(row * stride).check(L::WIDTH);
            to.bounds.after(row * to_stride).check_written(L::WIDTH);
        }
        // SAFETY: the caller's promise.
        unsafe { L::transpose(self.at.as_ptr(), stride, to.at.as_ptr(), to_stride) }
    }
}

/// What a pointer may reach.
#[cfg(test)]
#[derive(Clone, Copy)]
struct Bounds {
    offset: usize,
    len: usize,
    writable: bool,
}

#[cfg(test)]
impl Bounds {
    fn after(self, count: usize) -> Self {
        let offset = self.offset + count;
        assert!(offset <= self.len, "an address {offset} floats into {}", self.len);
        Self { offset, ..self }
    }

    fn check(self, count: usize) {
        self.after(count);
    }

    fn check_written(self, count: usize) {
        self.check(count);
        assert!(self.writable, "a write to what is only read");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panics(access: impl FnOnce() + std::panic::UnwindSafe) -> bool {
        std::panic::catch_unwind(access).is_err()
    }

    /// The check itself: at the end of a slice all is well, one float further nothing is.
    #[test]
    fn every_access_out_of_bounds_is_caught() {
        let (floats, mut room) = ([1.0; 20], [0.0; 20]);
        let (from, to) = (Pointer::to(&floats), Pointer::to_mut(&mut room));
        for offset in [19, 20] {
            let out = offset == 20;
            // SAFETY: the checks panic before anything is reached that is not there; f32 needs no feature.
            unsafe {
                assert_eq!(panics(|| _ = from.add(offset + 1)), out);
                assert_eq!(panics(|| _ = from.add(offset).get()), out);
                assert_eq!(panics(|| _ = from.add(offset).load::<f32>()), out);
                assert_eq!(panics(|| to.add(offset).store(1.0f32)), out);
                assert_eq!(panics(|| from.add(offset).transpose::<f32>(1, to, 1)), out);
                assert_eq!(panics(|| from.transpose::<f32>(1, to.add(offset), 1)), out);
                assert!(panics(|| from.store(1.0f32)), "a slice that is only read");
            }
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn a_vector_is_checked_whole() {
        use std::arch::x86_64::__m256;
        if super::super::Simd::named("avx2").is_none() {
            return;
        }
        let (floats, mut room) = ([1.0; 64], [0.0; 64]);
        let (from, to) = (Pointer::to(&floats), Pointer::to_mut(&mut room));
        for (offset, out) in [(56, false), (57, true)] {
            // SAFETY: AVX2 was detected; the checks panic before anything is reached that is not there.
            unsafe {
                assert_eq!(panics(|| _ = from.add(offset).load::<__m256>()), out);
                assert_eq!(panics(|| to.add(offset).store(from.load::<__m256>())), out);
                assert_eq!(panics(|| from.add(offset - 56).transpose::<__m256>(8, to, 8)), out);
                assert_eq!(panics(|| from.transpose::<__m256>(8, to.add(offset - 56), 8)), out);
            }
        }
    }
}
