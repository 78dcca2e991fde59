//! Pixels of a row at once, with what the processor has for it. All ways give the same bits.

/// Pixels that are filled at once.
pub const LANES: usize = 8;

/// What fills pixels.
pub trait Fill: Copy {
    /// A number for each pixel.
    type Numbers: Copy;
    /// `first`, `first + step`, and so on.
    fn ramp(self, first: i32, step: i32) -> Self::Numbers;
    /// All greater by `step`.
    fn stepped(self, numbers: Self::Numbers, step: i32) -> Self::Numbers;
    /// Gives to those pixels `id` that lie within all `edges`, and whose nearness grows by it; whether there are any. The nearness is `from` and the slopes times the second and the third edge.
    fn fill(
        self,
        edges: [Self::Numbers; 3],
        from: f32,
        slope: [f32; 2],
        id: u32,
        pixels: (&mut [f32; LANES], &mut [u32; LANES]),
    ) -> bool;
}

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Fill for Portable {
    type Numbers = [i32; LANES];

    #[inline(always)]
    fn ramp(self, first: i32, step: i32) -> [i32; LANES] {
        core::array::from_fn(|lane| first + lane as i32 * step)
    }

    #[inline(always)]
    fn stepped(self, numbers: [i32; LANES], step: i32) -> [i32; LANES] {
        numbers.map(|number| number + step)
    }

    #[inline(always)]
    fn fill(
        self,
        [of_a, of_b, of_c]: [[i32; LANES]; 3],
        from: f32,
        slope: [f32; 2],
        id: u32,
        (nearest, shown): (&mut [f32; LANES], &mut [u32; LANES]),
    ) -> bool {
        let mut any = false;
        for lane in 0..LANES {
            let nearness = from + (of_b[lane] as f32 * slope[0] + of_c[lane] as f32 * slope[1]);
            if of_a[lane] | of_b[lane] | of_c[lane] >= 0 && nearness > nearest[lane] {
                (nearest[lane], shown[lane]) = (nearness, id);
                any = true;
            }
        }
        any
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Fill, LANES};
    use core::arch::x86_64::{__m256i, _CMP_GT_OQ};
    use pulp::cast;
    use pulp::x86::V3;

    impl Fill for V3 {
        type Numbers = __m256i;

        #[inline(always)]
        fn ramp(self, first: i32, step: i32) -> __m256i {
            let lanes: __m256i = cast([0_i32, 1, 2, 3, 4, 5, 6, 7]);
            let steps = self.avx2._mm256_mullo_epi32(lanes, self.avx._mm256_set1_epi32(step));
            self.avx2._mm256_add_epi32(self.avx._mm256_set1_epi32(first), steps)
        }

        #[inline(always)]
        fn stepped(self, numbers: __m256i, step: i32) -> __m256i {
            self.avx2._mm256_add_epi32(numbers, self.avx._mm256_set1_epi32(step))
        }

        #[inline(always)]
        fn fill(
            self,
            [of_a, of_b, of_c]: [__m256i; 3],
            from: f32,
            slope: [f32; 2],
            id: u32,
            (nearest, shown): (&mut [f32; LANES], &mut [u32; LANES]),
        ) -> bool {
            let outside = self.avx2._mm256_or_si256(self.avx2._mm256_or_si256(of_a, of_b), of_c);
            let [to_b, to_c] = slope.map(|slope| self.avx._mm256_set1_ps(slope));
            let of_b = self.avx._mm256_mul_ps(self.avx._mm256_cvtepi32_ps(of_b), to_b);
            let of_c = self.avx._mm256_mul_ps(self.avx._mm256_cvtepi32_ps(of_c), to_c);
            let nearness = self.avx._mm256_add_ps(self.avx._mm256_set1_ps(from), self.avx._mm256_add_ps(of_b, of_c));
            let before = cast(*nearest);
            let nearer = self.avx._mm256_cmp_ps::<_CMP_GT_OQ>(nearness, before);
            // a number's sign says that its pixel is outside
            let takes = self.avx._mm256_andnot_ps(cast(self.avx2._mm256_srai_epi32::<31>(outside)), nearer);
            let any = self.avx._mm256_movemask_ps(takes) != 0;
            if any {
                *nearest = cast(self.avx._mm256_blendv_ps(before, nearness, takes));
                *shown = cast(self.avx2._mm256_blendv_epi8(cast(*shown), self.avx._mm256_set1_epi32(id as i32), cast(takes)));
            }
            any
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn all_ways_fill_the_same() {
        let Some(wide) = pulp::x86::V3::try_new() else {
            eprintln!("skipped: a processor without AVX2");
            return;
        };
        struct Both;
        fn filled<F: Fill>(fill: F, i: i32) -> ([f32; LANES], [u32; LANES], bool) {
            let edges = [(900 - 7 * i, -310), (11 * i - 200, 97), (i - 3, 13 + i)].map(|(first, step)| fill.ramp(first, step));
            let edges = edges.map(|edge| fill.stepped(edge, 5 * i));
            let mut nearest = core::array::from_fn(|lane| (lane as f32 * 0.37 + i as f32).sin());
            let mut shown = core::array::from_fn(|lane| lane as u32);
            let any = fill.fill(edges, 0.3, [1e-3, -2.3e-3], 99, (&mut nearest, &mut shown));
            (nearest, shown, any)
        }
        impl pulp::NullaryFnOnce for Both {
            type Output = Vec<([f32; LANES], [u32; LANES], bool)>;
            #[inline(always)]
            fn call(self) -> Self::Output {
                pulp::x86::V3::try_new().map_or_else(Vec::new, |wide| (0..200).map(|i| filled(wide, i)).collect())
            }
        }
        let told = wide.vectorize(Both);
        let wanted: Vec<_> = (0..200).map(|i| filled(Portable, i)).collect();
        assert_eq!(told, wanted);
        assert!(wanted.iter().any(|(_, _, any)| *any) && wanted.iter().any(|(_, _, any)| !any));
    }
}
