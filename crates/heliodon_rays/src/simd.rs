//! Vectors of 8 and 16 numbers, for the instruction sets that pay.
//!
//! The engine is written once over [`Engine`] and compiled for AVX-512, AVX2 and plain arrays (which the compiler turns
//! into SSE2 or NEON); [`Instructions`] picks at run time. All sets give the same bits: every operation is one that IEEE 754
//! defines to the bit, nothing is fused (Rust never contracts a multiplication and an addition by itself) and sums are never
//! reduced across lanes. Everything here and above it is `#[inline(always)]`, and vectors do not go through closures: a
//! function that is not inlined is compiled without the instructions and calls them one by one (measured: 8 times
//! slower). pulp's tokens prove that a set is there, so this needs no `unsafe`.

use core::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// A comparison's result.
pub(crate) trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// Bit i for lane i.
    fn bits(self) -> u32;
}

/// N numbers.
pub(crate) trait Vector<const N: usize>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    type Engine: Copy;
    type Mask: Mask;
    fn load(engine: Self::Engine, from: &[f32; N]) -> Self;
    fn splat(engine: Self::Engine, value: f32) -> Self;
    fn store(self) -> [f32; N];
    /// `self < other ? self : other`, as the hardware has it: `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `self > other ? self : other`.
    fn max(self, other: Self) -> Self;
    /// Less or equal; false where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Less; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;

    /// The least and the greatest of three.
    #[inline(always)]
    fn span(a: Self, b: Self, c: Self) -> [Self; 2] {
        [a.min(b).min(c), a.max(b).max(c)]
    }

    /// Whether the bounds hold an interval's part: `bounds[0] <= interval[1]` and `interval[0] <= bounds[1]`.
    #[inline(always)]
    fn meets(bounds: [Self; 2], interval: [Self; 2]) -> Self::Mask {
        bounds[0].le(interval[1]) & interval[0].le(bounds[1])
    }
}

/// An instruction set.
pub(crate) trait Engine: Copy {
    type F8: Vector<8, Engine = Self>;
    type F16: Vector<16, Engine = Self>;
    /// Runs `f`, whose code must be inlined, compiled for this set.
    fn run<R>(self, f: impl FnOnce() -> R) -> R;
}

/// Whatever the compiler makes of arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain;

/// A vector of [`Plain`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Array<const N: usize>([f32; N]);

impl Mask for u32 {
    #[inline(always)]
    fn bits(self) -> u32 {
        self
    }
}

impl<const N: usize> Array<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(core::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(&f32, &f32) -> bool) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(f(&self.0[i], &other.0[i])) << i)
    }
}

macro_rules! array_operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<const N: usize> $trait for Array<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
    };
}
array_operator!(Add, add, +);
array_operator!(Sub, sub, -);
array_operator!(Mul, mul, *);
array_operator!(Div, div, /);

impl<const N: usize> Vector<N> for Array<N> {
    type Engine = Plain;
    type Mask = u32;
    #[inline(always)]
    fn load(_: Plain, from: &[f32; N]) -> Self {
        Self(*from)
    }
    #[inline(always)]
    fn splat(_: Plain, value: f32) -> Self {
        Self([value; N])
    }
    #[inline(always)]
    fn store(self) -> [f32; N] {
        self.0
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        self.compare(other, f32::le)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        self.compare(other, f32::lt)
    }
}

impl Engine for Plain {
    type F8 = Array<8>;
    type F16 = Array<16>;
    #[inline(always)]
    fn run<R>(self, f: impl FnOnce() -> R) -> R {
        f()
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Add, BitAnd, BitOr, Div, Engine, Mask, Mul, Sub, Vector};
    use core::arch::x86_64::{__m256, __m512, _CMP_LE_OQ, _CMP_LT_OQ};
    use pulp::x86::{V3, V4};

    /// Comparisons of AVX2: all bits of a lane or none.
    #[derive(Clone, Copy)]
    pub(crate) struct Lanes(__m256, V3);

    impl BitAnd for Lanes {
        type Output = Self;
        #[inline(always)]
        fn bitand(self, other: Self) -> Self {
            Self(self.1.avx._mm256_and_ps(self.0, other.0), self.1)
        }
    }

    impl BitOr for Lanes {
        type Output = Self;
        #[inline(always)]
        fn bitor(self, other: Self) -> Self {
            Self(self.1.avx._mm256_or_ps(self.0, other.0), self.1)
        }
    }

    impl Mask for Lanes {
        #[inline(always)]
        fn bits(self) -> u32 {
            self.1.avx._mm256_movemask_ps(self.0) as u32
        }
    }

    impl Mask for u8 {
        #[inline(always)]
        fn bits(self) -> u32 {
            u32::from(self)
        }
    }

    impl Mask for u16 {
        #[inline(always)]
        fn bits(self) -> u32 {
            u32::from(self)
        }
    }

    macro_rules! operator {
        ($name:ident, $trait:ident, $method:ident, $set:ident, $intrinsic:ident) => {
            impl $trait for $name {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    Self(self.1.$set.$intrinsic(self.0, other.0), self.1)
                }
            }
        };
    }

    /// A vector in one register: name, token, register, width, mask, how a comparison becomes one, and the intrinsics.
    macro_rules! register {
        ($name:ident, $token:ident, $register:ident, $n:literal, $mask:ty, $of:expr, $set:ident,
         $add:ident, $sub:ident, $mul:ident, $div:ident, $min:ident, $max:ident, $splat:ident, $compared:ident, $compare:ident) => {
            #[derive(Clone, Copy)]
            pub(crate) struct $name($register, $token);
            operator!($name, Add, add, $set, $add);
            operator!($name, Sub, sub, $set, $sub);
            operator!($name, Mul, mul, $set, $mul);
            operator!($name, Div, div, $set, $div);
            impl Vector<$n> for $name {
                type Engine = $token;
                type Mask = $mask;
                #[inline(always)]
                fn load(token: $token, from: &[f32; $n]) -> Self {
                    Self(pulp::cast(*from), token)
                }
                #[inline(always)]
                fn splat(token: $token, value: f32) -> Self {
                    Self(token.$set.$splat(value), token)
                }
                #[inline(always)]
                fn store(self) -> [f32; $n] {
                    pulp::cast(self.0)
                }
                #[inline(always)]
                fn min(self, other: Self) -> Self {
                    Self(self.1.$set.$min(self.0, other.0), self.1)
                }
                #[inline(always)]
                fn max(self, other: Self) -> Self {
                    Self(self.1.$set.$max(self.0, other.0), self.1)
                }
                #[inline(always)]
                fn le(self, other: Self) -> $mask {
                    $of(self.1.$compared.$compare::<_CMP_LE_OQ>(self.0, other.0), self.1)
                }
                #[inline(always)]
                fn lt(self, other: Self) -> $mask {
                    $of(self.1.$compared.$compare::<_CMP_LT_OQ>(self.0, other.0), self.1)
                }
            }
        };
    }

    register!(
        Avx8,
        V3,
        __m256,
        8,
        Lanes,
        Lanes,
        avx,
        _mm256_add_ps,
        _mm256_sub_ps,
        _mm256_mul_ps,
        _mm256_div_ps,
        _mm256_min_ps,
        _mm256_max_ps,
        _mm256_set1_ps,
        avx,
        _mm256_cmp_ps
    );
    register!(
        Avx512x8,
        V4,
        __m256,
        8,
        u8,
        |mask, _| mask,
        avx,
        _mm256_add_ps,
        _mm256_sub_ps,
        _mm256_mul_ps,
        _mm256_div_ps,
        _mm256_min_ps,
        _mm256_max_ps,
        _mm256_set1_ps,
        avx512f,
        _mm256_cmp_ps_mask
    );
    register!(
        Avx512x16,
        V4,
        __m512,
        16,
        u16,
        |mask, _| mask,
        avx512f,
        _mm512_add_ps,
        _mm512_sub_ps,
        _mm512_mul_ps,
        _mm512_div_ps,
        _mm512_min_ps,
        _mm512_max_ps,
        _mm512_set1_ps,
        avx512f,
        _mm512_cmp_ps_mask
    );

    /// Two registers of AVX2.
    #[derive(Clone, Copy)]
    pub(crate) struct Pair<T>(T, T);

    macro_rules! pair_operator {
        ($trait:ident, $method:ident) => {
            impl<T: $trait<Output = T>> $trait for Pair<T> {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    Self(self.0.$method(other.0), self.1.$method(other.1))
                }
            }
        };
    }
    pair_operator!(Add, add);
    pair_operator!(Sub, sub);
    pair_operator!(Mul, mul);
    pair_operator!(Div, div);
    pair_operator!(BitAnd, bitand);
    pair_operator!(BitOr, bitor);

    impl Mask for Pair<Lanes> {
        #[inline(always)]
        fn bits(self) -> u32 {
            self.0.bits() | self.1.bits() << 8
        }
    }

    impl Vector<16> for Pair<Avx8> {
        type Engine = V3;
        type Mask = Pair<Lanes>;
        #[inline(always)]
        fn load(token: V3, from: &[f32; 16]) -> Self {
            let [low, high]: [[f32; 8]; 2] = pulp::cast(*from);
            Self(Avx8::load(token, &low), Avx8::load(token, &high))
        }
        #[inline(always)]
        fn splat(token: V3, value: f32) -> Self {
            Self(Avx8::splat(token, value), Avx8::splat(token, value))
        }
        #[inline(always)]
        fn store(self) -> [f32; 16] {
            pulp::cast([self.0.store(), self.1.store()])
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(self.0.min(other.0), self.1.min(other.1))
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(self.0.max(other.0), self.1.max(other.1))
        }
        #[inline(always)]
        fn le(self, other: Self) -> Pair<Lanes> {
            Pair(self.0.le(other.0), self.1.le(other.1))
        }
        #[inline(always)]
        fn lt(self, other: Self) -> Pair<Lanes> {
            Pair(self.0.lt(other.0), self.1.lt(other.1))
        }
    }

    impl Engine for V3 {
        type F8 = Avx8;
        type F16 = Pair<Avx8>;
        #[inline(always)]
        fn run<R>(self, f: impl FnOnce() -> R) -> R {
            self.vectorize(f)
        }
    }

    impl Engine for V4 {
        type F8 = Avx512x8;
        type F16 = Avx512x16;
        #[inline(always)]
        fn run<R>(self, f: impl FnOnce() -> R) -> R {
            self.vectorize(f)
        }
    }
}

/// The instruction sets that the engine is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// SSE2 on x86-64, NEON on 64-bit Arm: what every processor of the kind has.
    Baseline,
    /// AVX2.
    Avx2,
    /// AVX-512 (F, BW, CD, DQ and VL).
    Avx512,
}

impl Instructions {
    /// All that this processor has, the widest last. They differ in speed only.
    pub fn available() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        let more = [pulp::x86::V3::try_new().map(|_| Self::Avx2), pulp::x86::V4::try_new().map(|_| Self::Avx512)];
        #[cfg(not(target_arch = "x86_64"))]
        let more: [Option<Self>; 0] = [];
        core::iter::once(Self::Baseline).chain(more.into_iter().flatten()).collect()
    }

    /// The widest that this processor has.
    pub fn best() -> Self {
        Self::available().pop().unwrap_or(Self::Baseline)
    }
}

/// Work that is compiled for every instruction set.
pub(crate) trait Work {
    type Output;
    /// The work; its whole body must be inlined.
    fn run<E: Engine>(self, engine: E) -> Self::Output;
}

/// Does the work with the given instructions, or the nearest that there are.
pub(crate) fn dispatch<W: Work>(instructions: Instructions, work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if instructions == Instructions::Avx512
            && let Some(engine) = pulp::x86::V4::try_new()
        {
            return engine.run(
                #[inline(always)]
                || work.run(engine),
            );
        }
        if instructions != Instructions::Baseline
            && let Some(engine) = pulp::x86::V3::try_new()
        {
            return engine.run(
                #[inline(always)]
                || work.run(engine),
            );
        }
    }
    work.run(Plain)
}
