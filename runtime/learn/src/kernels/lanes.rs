//! Several floats side by side. Every operation is one IEEE operation on each lane, rounded once, so a lane
//! holds the same bits whatever the width.

/// `WIDTH` floats in a register.
///
/// # Safety
///
/// Every method may be called only on a CPU with the features of the implementation. `load` and `store` need
/// a pointer that is valid for `WIDTH` floats; it need not be aligned.
pub(super) trait Lanes: Copy {
    const WIDTH: usize;
    unsafe fn splat(value: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    unsafe fn div(self, other: Self) -> Self;
    unsafe fn sqrt(self) -> Self;
    /// self · factor + term, rounded once.
    unsafe fn mul_add(self, factor: Self, term: Self) -> Self;
    /// 0 where negative; NaN stays NaN.
    unsafe fn relu(self) -> Self;
    /// +0 where the magnitude is below the least normal number; NaN stays NaN.
    unsafe fn flush(self) -> Self;
    /// +0 where `condition` is not positive.
    unsafe fn where_positive(self, condition: Self) -> Self;
    /// `limit` where it is less; NaN stays NaN.
    unsafe fn at_most(self, limit: Self) -> Self;
    unsafe fn abs(self) -> Self;
    /// The magnitude of this, the sign of the other.
    unsafe fn with_sign_of(self, other: Self) -> Self;
    /// `below` where this is less than `limit`, else `otherwise`.
    unsafe fn choose_below(self, limit: Self, below: Self, otherwise: Self) -> Self;
    /// The bits moved left by 23: the last eight become the exponent.
    unsafe fn last_bits_as_exponent(self) -> Self;
    /// Turns `WIDTH` rows into columns: to\[j\]\[i\] = from\[i\]\[j\]. Rows begin every `from_stride` and
    /// `to_stride` floats.
    unsafe fn transpose(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize);
}

impl Lanes for f32 {
    const WIDTH: usize = 1;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        value
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller's pointer is valid for one float.
        unsafe { from.read_unaligned() }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller's pointer is valid for one float.
        unsafe { to.write_unaligned(self) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        self - other
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        self * other
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        self / other
    }

    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, term: Self) -> Self {
        f32::mul_add(self, factor, term)
    }

    #[inline(always)]
    unsafe fn relu(self) -> Self {
        if 0.0 > self { 0.0 } else { self }
    }

    #[inline(always)]
    unsafe fn flush(self) -> Self {
        if self.abs() < f32::MIN_POSITIVE { 0.0 } else { self }
    }

    #[inline(always)]
    unsafe fn where_positive(self, condition: Self) -> Self {
        if condition > 0.0 { self } else { 0.0 }
    }

    #[inline(always)]
    unsafe fn at_most(self, limit: Self) -> Self {
        if limit < self { limit } else { self }
    }

    #[inline(always)]
    unsafe fn abs(self) -> Self {
        f32::abs(self)
    }

    #[inline(always)]
    unsafe fn with_sign_of(self, other: Self) -> Self {
        self.copysign(other)
    }

    #[inline(always)]
    unsafe fn choose_below(self, limit: Self, below: Self, otherwise: Self) -> Self {
        if self < limit { below } else { otherwise }
    }

    #[inline(always)]
    unsafe fn last_bits_as_exponent(self) -> Self {
        f32::from_bits(self.to_bits() << 23)
    }

    #[inline(always)]
    unsafe fn transpose(from: *const f32, _: usize, to: *mut f32, _: usize) {
        // SAFETY: the caller's pointers are valid for one float.
        unsafe { to.write_unaligned(from.read_unaligned()) }
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use std::arch::x86_64::*;

    use super::Lanes;

    /// Vectors of the instruction set: the names of its operations, and how it flushes.
    macro_rules! vectors {
        ($vector:ident, $width:literal, $set:ident, $load:ident, $store:ident, $add:ident, $sub:ident, $mul:ident,
         $div:ident, $sqrt:ident, $fma:ident, $max:ident, $min:ident, $flush:ident, $where_positive:ident,
         $abs:ident, $with_sign_of:ident, $choose_below:ident, $last_bits_as_exponent:ident, $transpose:ident) => {
            // SAFETY of every block below: the caller promises the CPU's features, and valid pointers to `load`
            // and `store`; the instructions need nothing else.
            #[allow(clippy::undocumented_unsafe_blocks)]
            impl Lanes for $vector {
                const WIDTH: usize = $width;

                #[inline(always)]
                unsafe fn splat(value: f32) -> Self {
                    unsafe { $set(value) }
                }

                #[inline(always)]
                unsafe fn load(from: *const f32) -> Self {
                    unsafe { $load(from) }
                }

                #[inline(always)]
                unsafe fn store(self, to: *mut f32) {
                    unsafe { $store(to, self) }
                }

                #[inline(always)]
                unsafe fn add(self, other: Self) -> Self {
                    unsafe { $add(self, other) }
                }

                #[inline(always)]
                unsafe fn sub(self, other: Self) -> Self {
                    unsafe { $sub(self, other) }
                }

                #[inline(always)]
                unsafe fn mul(self, other: Self) -> Self {
                    unsafe { $mul(self, other) }
                }

                #[inline(always)]
                unsafe fn div(self, other: Self) -> Self {
                    unsafe { $div(self, other) }
                }

                #[inline(always)]
                unsafe fn sqrt(self) -> Self {
                    unsafe { $sqrt(self) }
                }

                #[inline(always)]
                unsafe fn mul_add(self, factor: Self, term: Self) -> Self {
                    unsafe { $fma(self, factor, term) }
                }

                #[inline(always)]
                unsafe fn relu(self) -> Self {
                    // The instruction gives its second operand where the two are not ordered.
                    unsafe { $max($set(0.0), self) }
                }

                #[inline(always)]
                unsafe fn flush(self) -> Self {
                    unsafe { $flush(self) }
                }

                #[inline(always)]
                unsafe fn where_positive(self, condition: Self) -> Self {
                    unsafe { $where_positive(self, condition) }
                }

                #[inline(always)]
                unsafe fn at_most(self, limit: Self) -> Self {
                    // As for `relu`.
                    unsafe { $min(limit, self) }
                }

                #[inline(always)]
                unsafe fn abs(self) -> Self {
                    unsafe { $abs(self) }
                }

                #[inline(always)]
                unsafe fn with_sign_of(self, other: Self) -> Self {
                    unsafe { $with_sign_of(self, other) }
                }

                #[inline(always)]
                unsafe fn choose_below(self, limit: Self, below: Self, otherwise: Self) -> Self {
                    unsafe { $choose_below(self, limit, below, otherwise) }
                }

                #[inline(always)]
                unsafe fn last_bits_as_exponent(self) -> Self {
                    unsafe { $last_bits_as_exponent(self) }
                }

                #[inline(always)]
                unsafe fn transpose(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize) {
                    unsafe { $transpose(from, from_stride, to, to_stride) }
                }
            }
        };
    }

    vectors!(
        __m512,
        16,
        _mm512_set1_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_add_ps,
        _mm512_sub_ps,
        _mm512_mul_ps,
        _mm512_div_ps,
        _mm512_sqrt_ps,
        _mm512_fmadd_ps,
        _mm512_max_ps,
        _mm512_min_ps,
        flush_512,
        where_positive_512,
        _mm512_abs_ps,
        with_sign_of_512,
        choose_below_512,
        last_bits_as_exponent_512,
        transpose_512
    );
    vectors!(
        __m256,
        8,
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_add_ps,
        _mm256_sub_ps,
        _mm256_mul_ps,
        _mm256_div_ps,
        _mm256_sqrt_ps,
        _mm256_fmadd_ps,
        _mm256_max_ps,
        _mm256_min_ps,
        flush_256,
        where_positive_256,
        abs_256,
        with_sign_of_256,
        choose_below_256,
        last_bits_as_exponent_256,
        transpose_256
    );

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn flush_512(x: __m512) -> __m512 {
        let keep = _mm512_cmp_ps_mask::<_CMP_NLT_UQ>(_mm512_abs_ps(x), _mm512_set1_ps(f32::MIN_POSITIVE));
        _mm512_maskz_mov_ps(keep, x)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn flush_256(x: __m256) -> __m256 {
        _mm256_and_ps(x, _mm256_cmp_ps::<_CMP_NLT_UQ>(abs_256(x), _mm256_set1_ps(f32::MIN_POSITIVE)))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn where_positive_512(x: __m512, condition: __m512) -> __m512 {
        _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(condition, _mm512_setzero_ps()), x)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn where_positive_256(x: __m256, condition: __m256) -> __m256 {
        _mm256_and_ps(x, _mm256_cmp_ps::<_CMP_GT_OQ>(condition, _mm256_setzero_ps()))
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn abs_256(x: __m256) -> __m256 {
        _mm256_andnot_ps(_mm256_set1_ps(-0.0), x)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn with_sign_of_512(x: __m512, other: __m512) -> __m512 {
        let sign = _mm512_and_epi32(_mm512_castps_si512(other), _mm512_set1_epi32(i32::MIN));
        _mm512_castsi512_ps(_mm512_or_epi32(_mm512_castps_si512(_mm512_abs_ps(x)), sign))
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn with_sign_of_256(x: __m256, other: __m256) -> __m256 {
        _mm256_or_ps(abs_256(x), _mm256_and_ps(other, _mm256_set1_ps(-0.0)))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn choose_below_512(x: __m512, limit: __m512, below: __m512, otherwise: __m512) -> __m512 {
        _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(x, limit), otherwise, below)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn choose_below_256(x: __m256, limit: __m256, below: __m256, otherwise: __m256) -> __m256 {
        _mm256_blendv_ps(otherwise, below, _mm256_cmp_ps::<_CMP_LT_OQ>(x, limit))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn last_bits_as_exponent_512(x: __m512) -> __m512 {
        _mm512_castsi512_ps(_mm512_slli_epi32::<23>(_mm512_castps_si512(x)))
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn last_bits_as_exponent_256(x: __m256) -> __m256 {
        _mm256_castsi256_ps(_mm256_slli_epi32::<23>(_mm256_castps_si256(x)))
    }

    /// # Safety
    ///
    /// Both pointers are valid for 16 rows of 16 floats at their strides.
    #[inline]
    #[target_feature(enable = "avx512f")]
    unsafe fn transpose_512(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize) {
        // Rows of the 4 × 4 tiles of 4 × 4 floats: first each tile is turned, then the tiles change places.
        let mut turned = [_mm512_setzero_ps(); 16];
        for k in 0..4 {
            // SAFETY: rows 4k to 4k + 3 of 16.
            let [a, b, c, d] =
                [0, 1, 2, 3].map(|r| unsafe { _mm512_loadu_ps(from.add((4 * k + r) * from_stride)) });
            let (ab_low, ab_high) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let (cd_low, cd_high) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
            turned[k] = _mm512_shuffle_ps::<0x44>(ab_low, cd_low);
            turned[4 + k] = _mm512_shuffle_ps::<0xee>(ab_low, cd_low);
            turned[8 + k] = _mm512_shuffle_ps::<0x44>(ab_high, cd_high);
            turned[12 + k] = _mm512_shuffle_ps::<0xee>(ab_high, cd_high);
        }
        for (r, tiles) in turned.chunks_exact(4).enumerate() {
            let (even_01, odd_01) = (
                _mm512_shuffle_f32x4::<0x88>(tiles[0], tiles[1]),
                _mm512_shuffle_f32x4::<0xdd>(tiles[0], tiles[1]),
            );
            let (even_23, odd_23) = (
                _mm512_shuffle_f32x4::<0x88>(tiles[2], tiles[3]),
                _mm512_shuffle_f32x4::<0xdd>(tiles[2], tiles[3]),
            );
            let columns = [
                _mm512_shuffle_f32x4::<0x88>(even_01, even_23),
                _mm512_shuffle_f32x4::<0x88>(odd_01, odd_23),
                _mm512_shuffle_f32x4::<0xdd>(even_01, even_23),
                _mm512_shuffle_f32x4::<0xdd>(odd_01, odd_23),
            ];
            for (tile, column) in columns.into_iter().enumerate() {
                // SAFETY: row 4 · tile + r of 16.
                unsafe { _mm512_storeu_ps(to.add((4 * tile + r) * to_stride), column) };
            }
        }
    }

    /// # Safety
    ///
    /// Both pointers are valid for 8 rows of 8 floats at their strides.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn transpose_256(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize) {
        // As for 16 × 16, with 2 × 2 tiles.
        let mut turned = [_mm256_setzero_ps(); 8];
        for k in 0..2 {
            // SAFETY: rows 4k to 4k + 3 of 8.
            let [a, b, c, d] =
                [0, 1, 2, 3].map(|r| unsafe { _mm256_loadu_ps(from.add((4 * k + r) * from_stride)) });
            let (ab_low, ab_high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (cd_low, cd_high) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            turned[k] = _mm256_shuffle_ps::<0x44>(ab_low, cd_low);
            turned[2 + k] = _mm256_shuffle_ps::<0xee>(ab_low, cd_low);
            turned[4 + k] = _mm256_shuffle_ps::<0x44>(ab_high, cd_high);
            turned[6 + k] = _mm256_shuffle_ps::<0xee>(ab_high, cd_high);
        }
        for (r, tiles) in turned.chunks_exact(2).enumerate() {
            let low = _mm256_permute2f128_ps::<0x20>(tiles[0], tiles[1]);
            let high = _mm256_permute2f128_ps::<0x31>(tiles[0], tiles[1]);
            // SAFETY: rows r and 4 + r of 8.
            unsafe {
                _mm256_storeu_ps(to.add(r * to_stride), low);
                _mm256_storeu_ps(to.add((4 + r) * to_stride), high);
            }
        }
    }
}
