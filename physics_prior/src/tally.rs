//! The ground in one cell of a risk map.

use terrain::{SurfaceCell, TerrainClass};
use traversability::{Ground, GroundFlags};

use crate::ground::Contact;

/// Surface cells of one risk cell, added up.
#[derive(Default)]
pub(crate) struct Tally {
    n_cells: u32,
    n_known: u32,
    gradient: [f32; 2],
    class_probability: [f32; TerrainClass::COUNT],
    obstacle: bool,
}

impl Tally {
    /// Adds a surface cell; `None` beyond the surface.
    pub fn add(&mut self, contact: &Contact, cell: Option<&SurfaceCell>) {
        self.n_cells += 1;
        if !contact.is_unknown() {
            self.n_known += 1;
            self.gradient[0] += contact.values[Contact::GRADIENT_EAST];
            self.gradient[1] += contact.values[Contact::GRADIENT_NORTH];
        }
        if let Some(cell) = cell {
            let sums = self.class_probability.iter_mut().zip(&cell.class_probability);
            sums.for_each(|(sum, probability)| *sum += probability);
            self.obstacle |= cell.class() == TerrainClass::Obstacle;
        }
    }

    /// What the risk cell is.
    pub fn ground(&self) -> Ground {
        let class = TerrainClass::ALL.into_iter().fold(TerrainClass::Open, |best, class| {
            let likelier = self.class_probability[class as usize] > self.class_probability[best as usize];
            if likelier { class } else { best }
        });
        let mut flags = GroundFlags::default();
        if self.obstacle {
            flags = flags.with(GroundFlags::OBSTACLE);
        }
        if 2 * self.n_known < self.n_cells {
            flags = flags.with(GroundFlags::UNKNOWN);
        }
        let gradient = self.gradient.map(|sum| sum / self.n_known.max(1) as f32);
        Ground { gradient, class: class as u8, flags, ..Ground::default() }
    }
}
