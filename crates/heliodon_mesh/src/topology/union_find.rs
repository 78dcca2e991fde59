//! Disjoint sets whose members know whether they agree with their set's first one.

/// The highest bit of a link: this member is turned against the one it points to.
const TURNED: u32 = 1 << 31;

/// Disjoint sets over `0..n`, 4 bytes a member. The least member stands for its set, so that nothing depends on the order of unions.
pub struct UnionFind(Vec<u32>);

impl UnionFind {
    /// As many sets as members.
    ///
    /// # Panics
    /// From 2^31 members on: the bit is taken.
    pub fn new(members: usize) -> Self {
        assert!(members < TURNED as usize, "more members than links can name");
        Self((0..members as u32).collect())
    }

    /// The least member of a member's set, and whether the member is turned against it.
    #[inline]
    pub fn find(&mut self, mut member: u32) -> (u32, bool) {
        let mut turned = 0;
        loop {
            let link = self.0[member as usize];
            let parent = link & !TURNED;
            if parent == member {
                return (member, turned != 0);
            }
            // path halving: each member on the way is hung one step higher
            let above = self.0[parent as usize];
            let hung = above ^ (link & TURNED);
            self.0[member as usize] = hung;
            turned ^= hung & TURNED;
            member = above & !TURNED;
        }
    }

    /// Unites two members' sets, the members turned against one another or not. False where they were in one set already, and in
    /// it stand the other way.
    #[inline]
    pub fn unite(&mut self, a: u32, b: u32, turned: bool) -> bool {
        let ((a, a_turned), (b, b_turned)) = (self.find(a), self.find(b));
        let turned = turned ^ a_turned ^ b_turned;
        if a == b {
            return !turned;
        }
        self.0[a.max(b) as usize] = a.min(b) | if turned { TURNED } else { 0 };
        true
    }

    /// For every member its set's number, counted in the order of their least members, twice, and one more where it is turned; and
    /// how many sets there are.
    pub fn into_numbers(mut self) -> (Vec<u32>, u32) {
        for member in 0..self.0.len() as u32 {
            let (root, turned) = self.find(member);
            self.0[member as usize] = root | if turned { TURNED } else { 0 };
        }
        let mut sets = 0;
        // the least member comes first, so its number already stands where the others point
        for member in 0..self.0.len() {
            let (root, turned) = (self.0[member] & !TURNED, self.0[member] & TURNED != 0);
            self.0[member] = if root as usize == member {
                sets += 1;
                (sets - 1) << 1
            } else {
                self.0[root as usize] | u32::from(turned)
            };
        }
        (self.0, sets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_add_up_along_the_way() {
        let mut sets = UnionFind::new(6);
        assert!(sets.unite(4, 3, true));
        assert!(sets.unite(3, 1, true));
        assert!(sets.unite(5, 1, false));
        assert_eq!([1, 3, 4, 5].map(|m| sets.find(m)), [(1, false), (1, true), (1, false), (1, false)]);
        assert!(sets.unite(4, 5, false));
        assert!(!sets.unite(4, 5, true), "a band with an odd number of turns has one side");
        let (numbers, count) = sets.into_numbers();
        assert_eq!(count, 3);
        assert_eq!(numbers, [0, 2, 4, 3, 2, 2]);
    }
}
