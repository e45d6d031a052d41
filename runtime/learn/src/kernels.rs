//! The kernels of dense layers, and the only unsafe code.
//!
//! [`Simd`] names a vector width that this CPU has; its methods are safe: they check the sizes, then run the
//! loops of `kernels::loops` in the entry points compiled for that width. All widths give the same bits.
#![allow(unsafe_code)]

mod lanes;
mod loops;
mod pointer;
mod roofline;
mod storage;
mod tanh;
#[cfg(test)]
mod tests;
mod transpose;

use std::ops::Range;
use std::sync::atomic::{AtomicU8, Ordering};

pub(crate) use loops::AdamStep;
pub(crate) use storage::{Dense, Panels, Rows};
pub(crate) use transpose::to_panels;

use crate::error::LearnError;
use pointer::Pointer;
use storage::BLOCK;

/// What a hidden layer makes of its sums. The numbers are those of saved policies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    /// max(0, x)
    Relu = 0,
    /// tanh x, within 2 units in the last place and with the same bits in every vector width.
    Tanh = 1,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Level {
    Scalar = 0,
    #[cfg(target_arch = "x86_64")]
    Avx2 = 1,
    #[cfg(target_arch = "x86_64")]
    Avx512 = 2,
}

/// A vector width of this CPU. It can only be had through [`Simd::named`] and [`Simd::best`], which look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Simd(Level);

/// What `force_simd` asked for; [`FREE`]: nothing.
static FORCED: AtomicU8 = AtomicU8::new(FREE);
const FREE: u8 = u8::MAX;

impl Simd {
    /// The width of that name, if it is one and this CPU has it.
    pub(crate) fn named(name: &str) -> Option<Self> {
        match name {
            #[cfg(target_arch = "x86_64")]
            "avx512" if is_x86_feature_detected!("avx512f") => Some(Self(Level::Avx512)),
            #[cfg(target_arch = "x86_64")]
            "avx2" if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") => {
                Some(Self(Level::Avx2))
            }
            "scalar" => Some(Self(Level::Scalar)),
            _ => None,
        }
    }

    /// The widths of this CPU, the widest first.
    pub(crate) fn available() -> impl Iterator<Item = Self> {
        ["avx512", "avx2", "scalar"].into_iter().filter_map(Self::named)
    }

    /// The forced width, or else the widest.
    pub(crate) fn best() -> Self {
        let forced = FORCED.load(Ordering::Relaxed);
        let chosen = Self::available().find(|simd| simd.0 as u8 == forced);
        chosen.or_else(|| Self::available().next()).unwrap_or(Self(Level::Scalar))
    }

    pub(crate) fn name(self) -> &'static str {
        match self.0 {
            Level::Scalar => "scalar",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => "avx512",
        }
    }
}

/// The vector width that a learner made now would use: `avx512`, `avx2` or `scalar`.
pub fn simd_level() -> &'static str {
    Simd::best().name()
}

/// Makes all learners and policies made from now on use a vector width, to check that it changes no bit.
///
/// Errors if there is no such width or this CPU lacks it.
pub fn force_simd(name: &str) -> Result<(), LearnError> {
    let simd = Simd::named(name).ok_or_else(|| LearnError::NoSuchSimd { name: name.to_owned() })?;
    FORCED.store(simd.0 as u8, Ordering::Relaxed);
    Ok(())
}

/// Entry points for one width: lanes, CPU features, and the block sizes that fit its registers.
macro_rules! entry_points {
    ($level:ident, $lanes:ty, $(#[$feature:meta],)? forward $fr:literal x $fc:literal, backward $br:literal x
     $bn:literal, update $ur:literal x $uc:literal) => {
        mod $level {
            use super::loops::{self, Backward, Forward, Update};
            use super::pointer::Pointer;
            use super::roofline;
            use super::tanh;
            use super::transpose::{self, Through};

            /// # Safety
            ///
            /// As [`loops::forward`].
            $(#[$feature])?
            pub(super) unsafe fn forward(a: &Forward) {
                // SAFETY: the caller's promise.
                unsafe { loops::forward::<$lanes, $fr, $fc>(a) }
            }

            /// # Safety
            ///
            /// As [`loops::backward`].
            $(#[$feature])?
            pub(super) unsafe fn backward(a: &Backward, from: usize, to: usize) {
                // SAFETY: the caller's promise.
                unsafe { loops::backward::<$lanes, $br, $bn>(a, from, to) }
            }

            /// # Safety
            ///
            /// As [`loops::update`] for the rows `0..inputs + 1`, of which the last are the biases.
            $(#[$feature])?
            pub(super) unsafe fn update(a: &Update, inputs: usize) {
                // SAFETY: the caller's promise.
                unsafe {
                    loops::update::<$lanes, $ur, $uc>(a, 0, inputs);
                    loops::update_biases::<$lanes, $uc>(a, inputs);
                }
            }

            /// [`backward`] and [`update`] in one pass over the weights: both for a few rows at a time.
            ///
            /// # Safety
            ///
            /// As both, where the weights of the two are the same and nothing else overlaps.
            $(#[$feature])?
            pub(super) unsafe fn backward_update(back: &Backward, a: &Update, inputs: usize) {
                let mut from = 0;
                while from < inputs {
                    let to = (from + super::BLOCK).min(inputs);
                    // SAFETY: the caller's promise; the gradient with respect to the inputs of these rows
                    // is complete before the rows change.
                    unsafe {
                        loops::backward::<$lanes, $br, $bn>(back, from, to);
                        loops::update::<$lanes, $ur, $uc>(a, from, to);
                    }
                    from = to;
                }
                // SAFETY: the caller's promise.
                unsafe { loops::update_biases::<$lanes, $uc>(a, inputs) };
            }

            /// # Safety
            ///
            /// As [`transpose::through`].
            $(#[$feature])?
            pub(super) unsafe fn through(a: &Through) {
                // SAFETY: the caller's promise.
                unsafe { transpose::through::<$lanes>(a) }
            }

            /// # Safety
            ///
            /// As [`tanh::tanh_of_all`].
            $(#[$feature])?
            pub(super) unsafe fn tanh_of_all(values: Pointer, len: usize) {
                // SAFETY: the caller's promise.
                unsafe { tanh::tanh_of_all::<$lanes>(values, len) }
            }

            /// # Safety
            ///
            /// As [`roofline::multiply_adds`].
            $(#[$feature])?
            pub(super) unsafe fn multiply_adds(rounds: usize) -> (f32, usize) {
                // SAFETY: the caller's promise.
                unsafe { roofline::multiply_adds::<$lanes>(rounds) }
            }

            /// # Safety
            ///
            /// As [`roofline::read`].
            $(#[$feature])?
            pub(super) unsafe fn read(from: Pointer, len: usize) -> f32 {
                // SAFETY: the caller's promise.
                unsafe { roofline::read::<$lanes>(from, len) }
            }

            /// # Safety
            ///
            /// As [`roofline::read_and_write`].
            $(#[$feature])?
            pub(super) unsafe fn read_and_write(arrays: [Pointer; 4], len: usize) {
                // SAFETY: the caller's promise.
                unsafe { roofline::read_and_write::<$lanes>(arrays, len) }
            }
        }
    };
}

entry_points!(scalar, f32, forward 4 x 3, backward 1 x 16, update 2 x 4);
#[cfg(target_arch = "x86_64")]
entry_points!(
    avx2, std::arch::x86_64::__m256, #[target_feature(enable = "avx2,fma")],
    forward 6 x 2, backward 6 x 2, update 1 x 8
);
#[cfg(target_arch = "x86_64")]
entry_points!(
    avx512, std::arch::x86_64::__m512, #[target_feature(enable = "avx512f")],
    forward 8 x 3, backward 16 x 1, update 8 x 2
);

/// Runs an entry point of the chosen width.
macro_rules! dispatch {
    ($simd:expr, $kernel:ident($($argument:expr),*)) => {
        // SAFETY: a `Simd` exists only where the CPU has its features; the caller of this macro has checked
        // the sizes, and exclusive borrows keep what is written apart from everything else.
        unsafe {
            match $simd.0 {
                Level::Scalar => scalar::$kernel($($argument),*),
                #[cfg(target_arch = "x86_64")]
                Level::Avx2 => avx2::$kernel($($argument),*),
                #[cfg(target_arch = "x86_64")]
                Level::Avx512 => avx512::$kernel($($argument),*),
            }
        }
    };
}

/// What [`Simd::update`] changes: the weights, both moments, and a target that follows the weights.
pub(crate) struct Trained<'a> {
    pub(crate) w: &'a mut Dense,
    pub(crate) m: &'a mut Dense,
    pub(crate) v: &'a mut Dense,
    pub(crate) target: Option<&'a mut Dense>,
}

impl Simd {
    /// y = x w + bias, then the activation if there is one. x: `[rows][inputs]`, y: `[rows][outputs]`.
    pub(crate) fn forward(self, w: &Dense, x: &Rows, activation: Option<Activation>, y: &mut Rows) {
        y.set_rows(x.rows());
        assert_eq!((x.features(), y.features()), (w.inputs(), w.outputs()));
        let a = loops::Forward {
            x: Pointer::to(x.used()),
            x_stride: x.stride(),
            rows: x.rows(),
            inputs: w.inputs(),
            w: Pointer::to(w.data()),
            stride: w.stride(),
            y: Pointer::to_mut(y.used_mut()),
            relu: activation == Some(Activation::Relu),
        };
        dispatch!(self, forward(&a));
        if activation == Some(Activation::Tanh) {
            self.tanh_of_all(y.used_mut());
        }
    }

    /// tanh of every value, in place. Whole blocks.
    fn tanh_of_all(self, values: &mut [f32]) {
        let len = values.len();
        assert!(len.is_multiple_of(BLOCK));
        let values = Pointer::to_mut(values);
        dispatch!(self, tanh_of_all(values, len));
    }

    /// dx = dy wᵀ for some of the inputs; the others stay as they are. dy: outputs, dx: inputs.
    pub(crate) fn backward(self, w: &Dense, inputs: Range<usize>, dy: &Panels, dx: &mut Panels) {
        assert!(inputs.end <= w.inputs());
        let a = backward_operands(w, dy, dx);
        dispatch!(self, backward(&a, inputs.start, inputs.end));
    }

    /// One step of Adam on w with the gradient xᵀ dy (and Σ dy for the biases), and of the target after w.
    pub(crate) fn update(self, x: &Rows, dy: &Rows, step: &AdamStep, trained: Trained<'_>) {
        let inputs = trained.w.inputs();
        let a = update_operands(x, dy, step, trained);
        dispatch!(self, update(&a, inputs));
    }

    /// [`Simd::backward`] for all inputs, then [`Simd::update`]; `dy` and `dy_panels` hold the same numbers.
    pub(crate) fn backward_update(
        self,
        x: &Rows,
        (dy, dy_panels): (&Rows, &Panels),
        dx: &mut Panels,
        step: &AdamStep,
        trained: Trained<'_>,
    ) {
        let inputs = trained.w.inputs();
        let mut back = backward_operands(trained.w, dy_panels, dx);
        let a = update_operands(x, dy, step, trained);
        // One pointer for reading and writing the weights.
        back.w = a.w;
        dispatch!(self, backward_update(&back, &a, inputs));
    }

    /// The gradient through an activation, in both layouts: `d` is multiplied by the derivative where `h` is
    /// the activation's output (ReLU: 0 where h ≤ 0; tanh: 1 − h²), and `d_rows` becomes the same as `d`.
    pub(crate) fn through(self, activation: Activation, h: &Rows, d: &mut Panels, d_rows: &mut Rows) {
        d_rows.set_rows(h.rows());
        assert_eq!((h.features(), h.features()), (d.features(), d_rows.features()));
        let stride = h.stride();
        let (h, d, d_rows) = (h.data(), d.data_mut(), d_rows.data_mut());
        let block = BLOCK * stride;
        for ((h, d), d_rows) in
            h.chunks_exact(block).zip(d.chunks_exact_mut(block)).zip(d_rows.chunks_exact_mut(block))
        {
            let (h, d, d_rows) = (Pointer::to(h), Pointer::to_mut(d), Pointer::to_mut(d_rows));
            let a = transpose::Through { activation, h, d, d_rows, stride };
            dispatch!(self, through(&a));
        }
    }
}

/// For measuring: nothing here is part of training.
impl Simd {
    /// `rounds` of independent fused multiply-adds in registers: their sum, and how many there were.
    pub(crate) fn multiply_adds(self, rounds: usize) -> (f32, usize) {
        dispatch!(self, multiply_adds(rounds))
    }

    /// The sum of all weights, from whole blocks of 8 vectors.
    pub(crate) fn read(self, w: &Dense) -> f32 {
        let len = w.data().len() / (8 * BLOCK) * (8 * BLOCK);
        dispatch!(self, read(Pointer::to(w.data()), len))
    }

    /// Reads four arrays of one size and writes them as they were.
    pub(crate) fn read_and_write(self, arrays: &mut [Dense; 4]) {
        let len = arrays.iter().map(|array| array.data().len()).min().unwrap_or(0);
        let arrays = arrays.each_mut().map(|array| Pointer::to_mut(array.data_mut()));
        dispatch!(self, read_and_write(arrays, len));
    }
}

/// Checks the sizes.
fn backward_operands(w: &Dense, dy: &Panels, dx: &mut Panels) -> loops::Backward {
    assert_eq!((dy.features(), dx.features()), (w.outputs(), w.inputs()));
    assert_eq!(dy.panels(), dx.panels());
    loops::Backward {
        panels: dy.panels(),
        dy: Pointer::to(dy.data()),
        outputs: w.outputs(),
        w: Pointer::to(w.data()),
        stride: w.stride(),
        dx: Pointer::to_mut(dx.data_mut()),
        dx_stride: dx.stride(),
    }
}

/// Checks the sizes.
fn update_operands<'a>(x: &Rows, dy: &Rows, step: &'a AdamStep, trained: Trained<'_>) -> loops::Update<'a> {
    let Trained { w, m, v, target } = trained;
    let shape = (w.inputs(), w.outputs());
    assert_eq!((x.features(), dy.features()), shape);
    assert_eq!(x.rows(), dy.rows());
    for other in [Some(&*m), Some(&*v), target.as_deref()].into_iter().flatten() {
        assert_eq!((other.inputs(), other.outputs()), shape);
    }
    loops::Update {
        x: Pointer::to(x.used()),
        x_stride: x.stride(),
        rows: x.rows(),
        dy: Pointer::to(dy.used()),
        stride: w.stride(),
        w: Pointer::to_mut(w.data_mut()),
        m: Pointer::to_mut(m.data_mut()),
        v: Pointer::to_mut(v.data_mut()),
        target: target.map(|target| Pointer::to_mut(target.data_mut())),
        step,
    }
}
