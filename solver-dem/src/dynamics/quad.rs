//! Four numbers at a time, on whatever the processor has.
//!
//! The inner loop is written once, against [`Quad`]. Every operation is one IEEE operation a lane, or moves bits,
//! so all implementations give the same results to the last bit; nothing is contracted into fused operations.

/// Arithmetic on registers of four lanes. Methods take the token that proves what the processor can do.
pub(super) trait Quad: Copy {
    /// Four numbers.
    type Reg: Copy;
    /// Four answers to a comparison.
    type Mask: Copy;

    fn load(self, lanes: &[f64; 4]) -> Self::Reg;
    fn store(self, lanes: &mut [f64; 4], a: Self::Reg);
    fn add(self, a: Self::Reg, b: Self::Reg) -> Self::Reg;
    fn sub(self, a: Self::Reg, b: Self::Reg) -> Self::Reg;
    fn mul(self, a: Self::Reg, b: Self::Reg) -> Self::Reg;
    fn div(self, a: Self::Reg, b: Self::Reg) -> Self::Reg;
    fn sqrt(self, a: Self::Reg) -> Self::Reg;
    /// a where a > b, else b (also where one of them is no number).
    fn larger(self, a: Self::Reg, b: Self::Reg) -> Self::Reg;
    /// a where a < b, else b (also where one of them is no number).
    fn smaller(self, a: Self::Reg, b: Self::Reg) -> Self::Reg;
    /// a > b.
    fn above(self, a: Self::Reg, b: Self::Reg) -> Self::Mask;
    /// a where the mask holds, else b.
    fn choose(self, mask: Self::Mask, a: Self::Reg, b: Self::Reg) -> Self::Reg;
    /// Whether the mask holds in every lane.
    fn all(self, mask: Self::Mask) -> bool;
    /// Whether the mask holds in some lane.
    fn any(self, mask: Self::Mask) -> bool;
    /// [−a0, −a1, a2, a3].
    fn negate_first_two(self, a: Self::Reg) -> Self::Reg;
    /// Rows become columns.
    fn transpose(self, rows: [Self::Reg; 4]) -> [Self::Reg; 4];

    #[inline(always)]
    fn splat(self, value: f64) -> Self::Reg {
        self.load(&[value; 4])
    }
}

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plain;

/// One operation, lane by lane.
#[inline(always)]
fn each(a: [f64; 4], b: [f64; 4], operation: impl Fn(f64, f64) -> f64) -> [f64; 4] {
    let mut result = [0.0; 4];
    for l in 0..4 {
        result[l] = operation(a[l], b[l]);
    }
    result
}

impl Quad for Plain {
    type Reg = [f64; 4];
    type Mask = [bool; 4];

    #[inline(always)]
    fn load(self, lanes: &[f64; 4]) -> [f64; 4] {
        *lanes
    }
    #[inline(always)]
    fn store(self, lanes: &mut [f64; 4], a: [f64; 4]) {
        *lanes = a;
    }
    #[inline(always)]
    fn add(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn sqrt(self, a: [f64; 4]) -> [f64; 4] {
        each(a, a, |a, _| a.sqrt())
    }
    #[inline(always)]
    fn larger(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn smaller(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn above(self, a: [f64; 4], b: [f64; 4]) -> [bool; 4] {
        [a[0] > b[0], a[1] > b[1], a[2] > b[2], a[3] > b[3]]
    }
    #[inline(always)]
    fn choose(self, mask: [bool; 4], a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        let mut result = b;
        for l in 0..4 {
            if mask[l] {
                result[l] = a[l];
            }
        }
        result
    }
    #[inline(always)]
    fn all(self, mask: [bool; 4]) -> bool {
        mask == [true; 4]
    }
    #[inline(always)]
    fn any(self, mask: [bool; 4]) -> bool {
        mask != [false; 4]
    }
    #[inline(always)]
    fn negate_first_two(self, a: [f64; 4]) -> [f64; 4] {
        [-a[0], -a[1], a[2], a[3]]
    }
    #[inline(always)]
    fn transpose(self, rows: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
        let mut columns = [[0.0; 4]; 4];
        for c in 0..4 {
            for l in 0..4 {
                columns[c][l] = rows[l][c];
            }
        }
        columns
    }
}

/// What every x86-64 processor has (SSE2), and AVX2.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{__m128d, __m256d, _CMP_GT_OQ};

    use pulp::{
        cast,
        x86::{V1, V3},
    };

    use super::Quad;

    /// Two registers of two lanes.
    type Pair = [__m128d; 2];

    impl Quad for V1 {
        type Reg = Pair;
        type Mask = Pair;

        #[inline(always)]
        fn load(self, lanes: &[f64; 4]) -> Pair {
            cast(*lanes)
        }
        #[inline(always)]
        fn store(self, lanes: &mut [f64; 4], a: Pair) {
            *lanes = cast(a);
        }
        #[inline(always)]
        fn add(self, a: Pair, b: Pair) -> Pair {
            [
                self.sse2._mm_add_pd(a[0], b[0]),
                self.sse2._mm_add_pd(a[1], b[1]),
            ]
        }
        #[inline(always)]
        fn sub(self, a: Pair, b: Pair) -> Pair {
            [
                self.sse2._mm_sub_pd(a[0], b[0]),
                self.sse2._mm_sub_pd(a[1], b[1]),
            ]
        }
        #[inline(always)]
        fn mul(self, a: Pair, b: Pair) -> Pair {
            [
                self.sse2._mm_mul_pd(a[0], b[0]),
                self.sse2._mm_mul_pd(a[1], b[1]),
            ]
        }
        #[inline(always)]
        fn div(self, a: Pair, b: Pair) -> Pair {
            [
                self.sse2._mm_div_pd(a[0], b[0]),
                self.sse2._mm_div_pd(a[1], b[1]),
            ]
        }
        #[inline(always)]
        fn sqrt(self, a: Pair) -> Pair {
            [self.sse2._mm_sqrt_pd(a[0]), self.sse2._mm_sqrt_pd(a[1])]
        }
        #[inline(always)]
        fn larger(self, a: Pair, b: Pair) -> Pair {
            [
                self.sse2._mm_max_pd(a[0], b[0]),
                self.sse2._mm_max_pd(a[1], b[1]),
            ]
        }
        #[inline(always)]
        fn smaller(self, a: Pair, b: Pair) -> Pair {
            [
                self.sse2._mm_min_pd(a[0], b[0]),
                self.sse2._mm_min_pd(a[1], b[1]),
            ]
        }
        #[inline(always)]
        fn above(self, a: Pair, b: Pair) -> Pair {
            [
                self.sse2._mm_cmpgt_pd(a[0], b[0]),
                self.sse2._mm_cmpgt_pd(a[1], b[1]),
            ]
        }
        #[inline(always)]
        fn choose(self, mask: Pair, a: Pair, b: Pair) -> Pair {
            let mut result = b;
            for k in 0..2 {
                result[k] = self.sse2._mm_or_pd(
                    self.sse2._mm_and_pd(mask[k], a[k]),
                    self.sse2._mm_andnot_pd(mask[k], b[k]),
                );
            }
            result
        }
        #[inline(always)]
        fn all(self, mask: Pair) -> bool {
            self.sse2._mm_movemask_pd(mask[0]) & self.sse2._mm_movemask_pd(mask[1]) == 0b11
        }
        #[inline(always)]
        fn any(self, mask: Pair) -> bool {
            self.sse2._mm_movemask_pd(mask[0]) | self.sse2._mm_movemask_pd(mask[1]) != 0
        }
        #[inline(always)]
        fn negate_first_two(self, a: Pair) -> Pair {
            [
                self.sse2._mm_xor_pd(a[0], self.sse2._mm_set_pd(-0.0, -0.0)),
                a[1],
            ]
        }
        #[inline(always)]
        fn transpose(self, [a, b, c, d]: [Pair; 4]) -> [Pair; 4] {
            [
                [
                    self.sse2._mm_unpacklo_pd(a[0], b[0]),
                    self.sse2._mm_unpacklo_pd(c[0], d[0]),
                ],
                [
                    self.sse2._mm_unpackhi_pd(a[0], b[0]),
                    self.sse2._mm_unpackhi_pd(c[0], d[0]),
                ],
                [
                    self.sse2._mm_unpacklo_pd(a[1], b[1]),
                    self.sse2._mm_unpacklo_pd(c[1], d[1]),
                ],
                [
                    self.sse2._mm_unpackhi_pd(a[1], b[1]),
                    self.sse2._mm_unpackhi_pd(c[1], d[1]),
                ],
            ]
        }
    }

    impl Quad for V3 {
        type Reg = __m256d;
        type Mask = __m256d;

        #[inline(always)]
        fn load(self, lanes: &[f64; 4]) -> __m256d {
            cast(*lanes)
        }
        #[inline(always)]
        fn store(self, lanes: &mut [f64; 4], a: __m256d) {
            *lanes = cast(a);
        }
        #[inline(always)]
        fn add(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_add_pd(a, b)
        }
        #[inline(always)]
        fn sub(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_sub_pd(a, b)
        }
        #[inline(always)]
        fn mul(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_mul_pd(a, b)
        }
        #[inline(always)]
        fn div(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_div_pd(a, b)
        }
        #[inline(always)]
        fn sqrt(self, a: __m256d) -> __m256d {
            self.avx._mm256_sqrt_pd(a)
        }
        #[inline(always)]
        fn larger(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_max_pd(a, b)
        }
        #[inline(always)]
        fn smaller(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_min_pd(a, b)
        }
        #[inline(always)]
        fn above(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_cmp_pd::<_CMP_GT_OQ>(a, b)
        }
        #[inline(always)]
        fn choose(self, mask: __m256d, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_blendv_pd(b, a, mask)
        }
        #[inline(always)]
        fn all(self, mask: __m256d) -> bool {
            self.avx._mm256_movemask_pd(mask) == 0b1111
        }
        #[inline(always)]
        fn any(self, mask: __m256d) -> bool {
            self.avx._mm256_movemask_pd(mask) != 0
        }
        #[inline(always)]
        fn negate_first_two(self, a: __m256d) -> __m256d {
            self.avx._mm256_xor_pd(a, cast([-0.0_f64, -0.0, 0.0, 0.0]))
        }
        #[inline(always)]
        fn transpose(self, [a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
            let avx = self.avx;
            let (ab, cd) = (avx._mm256_unpacklo_pd(a, b), avx._mm256_unpacklo_pd(c, d));
            let (ba, dc) = (avx._mm256_unpackhi_pd(a, b), avx._mm256_unpackhi_pd(c, d));
            [
                avx._mm256_permute2f128_pd::<0x20>(ab, cd),
                avx._mm256_permute2f128_pd::<0x20>(ba, dc),
                avx._mm256_permute2f128_pd::<0x31>(ab, cd),
                avx._mm256_permute2f128_pd::<0x31>(ba, dc),
            ]
        }
    }
}
