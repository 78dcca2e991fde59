//! What a long step has done so far, kept beside it, so that whoever is interrupted need not do all of it again.

use rayon::prelude::*;

/// Where a step leaves what it has done so far. What is taken changes no result: it is what the step would have made.
pub trait Interim: Sync {
    /// What was kept under a number, whole, or nothing.
    fn take(&self, number: usize) -> Option<Vec<u8>>;

    /// Whether so much time has passed since anything was kept that it is worth while again.
    fn is_due(&self) -> bool;

    /// Keeps something under a number, or does not: the step goes on all the same.
    fn keep(&self, number: usize, bytes: &[u8]);
}

/// Keeps nothing.
#[derive(Clone, Copy, Debug)]
pub struct Nowhere;

impl Interim for Nowhere {
    fn take(&self, _number: usize) -> Option<Vec<u8>> {
        None
    }

    fn is_due(&self) -> bool {
        false
    }

    fn keep(&self, _number: usize, _bytes: &[u8]) {}
}

/// From one of a step's rounds to the next, numbers go on by so many.
pub(crate) const NUMBERS: usize = 1 << 24;

/// A piece of work that can be kept, as numbers of 32 bits.
pub(crate) trait Kept: Sized + Send {
    fn put(&self, into: &mut Vec<u32>);

    /// What [`Kept::put`] has put, or nothing where it did not.
    fn get(from: &mut impl Iterator<Item = u32>) -> Option<Self>;
}

/// A number for each of many, after how many they are.
impl Kept for Vec<u32> {
    fn put(&self, into: &mut Vec<u32>) {
        into.push(self.len() as u32);
        into.extend(self);
    }

    fn get(from: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let count = from.next()?;
        (0..count).map(|_| from.next()).collect()
    }
}

/// Makes `count` things, several at once, or takes those that were kept; each that is there is told to `done`. Before it is asked whether they are to be kept
/// a thread makes one, then two and so on up to `each`: enough that nobody waits long for the last, few enough that they take seconds. Numbers begin
/// with `first`.
pub(crate) fn made_or_kept<T: Kept>(
    interim: &dyn Interim,
    (first, count): (usize, usize),
    each: usize,
    make: impl Fn(usize) -> T + Sync,
    done: impl Fn(usize) + Sync,
) -> Vec<T> {
    let mut made: Vec<T> = Vec::with_capacity(count);
    let (mut kept, mut size) = (0, 1);
    while made.len() < count {
        let begin = made.len();
        if let Some(mut taken) = interim.take(first + begin).and_then(|bytes| of_bytes(&bytes, count - begin)) {
            made.append(&mut taken);
            (begin..made.len()).for_each(&done);
            kept = made.len();
            continue;
        }
        let batch = begin..(begin + size * rayon::current_num_threads()).min(count);
        size = (2 * size).min(each);
        let make = |index: usize| {
            let made = make(index);
            done(index);
            made
        };
        made.par_extend(batch.into_par_iter().map(make));
        if made.len() < count && interim.is_due() {
            interim.keep(first + kept, &bytes_of(&made[kept..]));
            kept = made.len();
        }
    }
    made
}

fn bytes_of<T: Kept>(made: &[T]) -> Vec<u8> {
    let mut numbers = Vec::new();
    made.iter().for_each(|one| one.put(&mut numbers));
    numbers.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// One or more, but no more than `most`.
fn of_bytes<T: Kept>(bytes: &[u8], most: usize) -> Option<Vec<T>> {
    let (numbers, rest) = bytes.as_chunks::<4>();
    let mut numbers = numbers.iter().map(|number| u32::from_le_bytes(*number)).peekable();
    let mut made = Vec::new();
    while numbers.peek().is_some() {
        made.push(T::get(&mut numbers)?);
    }
    (rest.is_empty() && (1..=most).contains(&made.len())).then_some(made)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Keeps everything that it is offered, up to a number of times.
    #[derive(Default)]
    pub(crate) struct Shelf {
        kept: Mutex<BTreeMap<usize, Vec<u8>>>,
        pub most: usize,
    }

    impl Shelf {
        pub fn len(&self) -> usize {
            self.kept.lock().unwrap().len()
        }
    }

    impl Interim for Shelf {
        fn take(&self, number: usize) -> Option<Vec<u8>> {
            self.kept.lock().unwrap().get(&number).cloned()
        }

        fn is_due(&self) -> bool {
            self.len() < self.most
        }

        fn keep(&self, number: usize, bytes: &[u8]) {
            assert!(self.kept.lock().unwrap().insert(number, bytes.to_vec()).is_none(), "{number} was kept before");
        }
    }

    #[test]
    fn what_was_kept_is_not_made_again() {
        // two threads, whatever the machine has: batches are small then
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let shelf = Shelf { most: 3, ..Shelf::default() };
        let made = AtomicUsize::new(0);
        let make = |index: usize| {
            made.fetch_add(1, Ordering::Relaxed);
            vec![index as u32; index % 5]
        };
        let all = |shelf: &dyn Interim| {
            made.store(0, Ordering::Relaxed);
            let told = AtomicUsize::new(0);
            let tell = |index| {
                told.fetch_add(index, Ordering::Relaxed);
            };
            let all = pool.install(|| made_or_kept(shelf, (1000, 300), 2, make, tell));
            assert_eq!(told.into_inner(), 299 * 150, "each is told once");
            (all, made.load(Ordering::Relaxed))
        };
        let (whole, count) = all(&Nowhere);
        assert_eq!((whole.len(), count), (300, 300));
        let (first, count) = all(&shelf);
        assert!(first == whole && count == 300 && shelf.len() == 3);
        let (again, count) = all(&shelf);
        assert!(again == whole && count == 300 - (2 + 4 + 4), "{count}");
    }

    #[test]
    fn what_is_damaged_is_made_again() {
        for bytes in [&[][..], &[1, 0, 0, 0], &[1, 0, 0], &[2, 0, 0, 0, 7, 0, 0, 0]] {
            let shelf = Shelf::default();
            shelf.keep(0, bytes);
            assert_eq!(made_or_kept(&shelf, (0, 2), 1, |index| vec![index as u32], |_| ()), [[0], [1]], "{bytes:?}");
        }
        let shelf = Shelf::default();
        shelf.keep(0, &bytes_of(&vec![vec![9_u32]; 3]));
        assert_eq!(made_or_kept(&shelf, (0, 2), 1, |index| vec![index as u32], |_| ()), [[0], [1]], "more than there are");
    }
}
