//! Choosing elements and putting them into regions.

use thiserror::Error;

use super::Mesh;

/// A region was given an element that the mesh does not have.
#[derive(Error, Clone, Copy, PartialEq, Eq, Debug)]
#[error("assign a region: there is no element e{element} (the mesh has {count})")]
pub struct UnknownElement {
    /// The number asked for.
    pub element: usize,
    /// Number of elements of the mesh.
    pub count: usize,
}

impl<const D: usize> Mesh<D> {
    /// Puts elements into the region `name`, which is created where it does not exist yet. An
    /// element belongs to the region it was put into last. Returns the region's index.
    ///
    /// # Errors
    /// An element number beyond the mesh; then nothing is changed.
    pub fn assign_region(
        &mut self,
        name: &str,
        elements: &[usize],
    ) -> Result<usize, UnknownElement> {
        let count = self.element_count();
        if let Some(&element) = elements.iter().find(|&&element| element >= count) {
            return Err(UnknownElement { element, count });
        }
        let region = match self.region_names.iter().position(|known| known == name) {
            Some(region) => region,
            None => {
                self.region_names.push(name.to_owned());
                self.region_names.len() - 1
            }
        };
        for &element in elements {
            self.regions[element] = region;
        }
        Ok(region)
    }

    /// Elements whose centre lies in the box `low ≤ x ≤ high`, ascending.
    pub fn elements_in_box(&self, low: [f64; D], high: [f64; D]) -> Vec<usize> {
        self.elements_where(|centre| (0..D).all(|i| low[i] <= centre[i] && centre[i] <= high[i]))
    }

    /// Elements whose centre lies in the ellipse Σ((x−c)_i/a_i)² ≤ 1, ascending.
    pub fn elements_in_ellipse(&self, centre: [f64; D], semi_axes: [f64; D]) -> Vec<usize> {
        self.elements_where(|x| {
            (0..D)
                .map(|i| (x[i] - centre[i]) / semi_axes[i])
                .map(|ratio| ratio * ratio)
                .sum::<f64>()
                <= 1.0
        })
    }

    fn elements_where(&self, inside: impl Fn([f64; D]) -> bool) -> Vec<usize> {
        (0..self.element_count())
            .filter(|&e| inside(self.element_centre(e)))
            .collect()
    }
}
