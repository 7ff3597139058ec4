//! The nearest few of many.

/// A reference at a distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Neighbour {
    /// Squared Euclidean distance or number of differing bits.
    pub distance: i32,
    /// Number of the face.
    pub face: u32,
    /// Number within the face's set, or within what was searched of it.
    pub reference: u32,
}

/// The k nearest so far; equally near ones in the order in which they were found.
#[derive(Debug, Clone)]
pub struct Nearest {
    k: usize,
    farthest: i32,
    found: Vec<Neighbour>,
}

impl Nearest {
    /// None yet; `k` is at least one, and only those nearer than `farthest` get in.
    pub fn new(k: usize, farthest: i32) -> Self {
        Self {
            k,
            farthest,
            found: Vec::with_capacity(k),
        }
    }

    /// What the distance of another one must be below to get in, if it comes after those found.
    pub fn limit(&self) -> i32 {
        match self.found.get(self.k - 1) {
            Some(last) => last.distance,
            None => self.farthest,
        }
    }

    /// Takes a neighbour that comes after those found, in the order of the index, and is below the
    /// limit.
    pub fn insert(&mut self, neighbour: Neighbour) {
        if self.found.len() < self.k {
            self.found.push(neighbour);
        }
        let mut place = self.found.len() - 1;
        while place > 0 && self.found[place - 1].distance > neighbour.distance {
            self.found[place] = self.found[place - 1];
            place -= 1;
        }
        self.found[place] = neighbour;
    }

    /// Those found, in order.
    pub fn found(&self) -> &[Neighbour] {
        &self.found
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.found.clear();
    }
}
