//! States in the order of a growing estimate, to within a bucket's width.

/// Lists of states, one for each slice of cost, reused in a circle.
pub(super) struct Buckets {
    lists: Vec<Vec<(u32, f32)>>,
    width: f32,
    /// The slice that is being emptied.
    current: u64,
    n_queued: usize,
}

impl Buckets {
    /// For costs that lie at most `span` above the lowest that is queued.
    pub fn new(width: f32, span: f32) -> Self {
        let n_lists = (span / width).ceil() as usize + 2;
        Self { lists: vec![Vec::new(); n_lists], width, current: u64::MAX, n_queued: 0 }
    }

    /// Adds a state that costs `cost` to reach, in the slice of `estimate`.
    pub fn put(&mut self, state: u32, cost: f32, estimate: f32) {
        let slice = (estimate / self.width) as u64;
        // What lies below the slice that is being emptied by rounding alone belongs to it.
        let slice = if self.current == u64::MAX { slice } else { slice.max(self.current) };
        if self.n_queued == 0 && self.current == u64::MAX {
            self.current = slice;
        }
        let n_lists = self.lists.len() as u64;
        self.lists[(slice % n_lists) as usize].push((state, cost));
        self.n_queued += 1;
    }

    /// A state of the lowest slice that holds any, the cost that it was put with, and the estimate at which the slice
    /// begins.
    pub fn take(&mut self) -> Option<(u32, f32, f32)> {
        if self.n_queued == 0 {
            return None;
        }
        let n_lists = self.lists.len() as u64;
        loop {
            if let Some((state, cost)) = self.lists[(self.current % n_lists) as usize].pop() {
                self.n_queued -= 1;
                return Some((state, cost, self.current as f32 * self.width));
            }
            self.current += 1;
        }
    }
}
