//! A queue of cells ordered by time to within one bucket's width, with all memory allocated at the start.

/// Marks the end of a list and a cell that is in none.
const NONE: u32 = u32::MAX;

/// Doubly linked lists of cells, one for each slice of time, reused in a circle. A cell is in at most one list.
pub struct BucketQueue {
    /// First cell of each list.
    first: Vec<u32>,
    /// Neighbours in the list and the bucket of each cell.
    links: Vec<Link>,
    width_s: f32,
    /// The bucket being emptied, counted from time zero.
    current: u64,
    n_queued: usize,
}

#[derive(Clone, Copy)]
struct Link {
    previous: u32,
    next: u32,
    bucket: u32,
}

impl BucketQueue {
    /// A queue for cells 0..`n_cells` over a span of `n_buckets` widths.
    pub fn new(n_buckets: usize, n_cells: usize) -> Self {
        let unlinked = Link { previous: NONE, next: NONE, bucket: NONE };
        Self {
            first: vec![NONE; n_buckets],
            links: vec![unlinked; n_cells],
            width_s: 1.0,
            current: u64::MAX,
            n_queued: 0,
        }
    }

    /// Begins anew with buckets of another width; the queue must have been emptied.
    pub fn restart(&mut self, width_s: f32) {
        self.width_s = width_s;
        self.current = u64::MAX;
    }

    /// Adds a cell, or moves it to its new time [s].
    pub fn put(&mut self, cell: usize, time_s: f32) {
        if self.links[cell].bucket != NONE {
            self.unlink(cell);
        }
        let slice = (time_s / self.width_s) as u64;
        self.current = self.current.min(slice);
        let bucket = (slice % self.first.len() as u64) as usize;
        let next = self.first[bucket];
        if next != NONE {
            self.links[next as usize].previous = cell as u32;
        }
        self.first[bucket] = cell as u32;
        self.links[cell] = Link { previous: NONE, next, bucket: bucket as u32 };
        self.n_queued += 1;
    }

    /// Takes out a cell of the earliest bucket that holds any.
    pub fn take(&mut self) -> Option<usize> {
        if self.n_queued == 0 {
            return None;
        }
        let n_buckets = self.first.len() as u64;
        let mut bucket = (self.current % n_buckets) as usize;
        while self.first[bucket] == NONE {
            self.current += 1;
            bucket = (self.current % n_buckets) as usize;
        }
        let cell = self.first[bucket] as usize;
        self.unlink(cell);
        Some(cell)
    }

    fn unlink(&mut self, cell: usize) {
        let Link { previous, next, bucket } = self.links[cell];
        if next != NONE {
            self.links[next as usize].previous = previous;
        }
        if previous == NONE {
            self.first[bucket as usize] = next;
        } else {
            self.links[previous as usize].next = next;
        }
        self.links[cell].bucket = NONE;
        self.n_queued -= 1;
    }
}
