//! Which pairs of grains can touch.

use pulp::NullaryFnOnce;

use crate::{
    Cell,
    simd::Simd,
    tensor::{Vector, apply},
};

/// Two grains that are near each other, through which image of the cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair<const D: usize> {
    /// The lower grain number.
    pub i: u32,
    /// The higher grain number.
    pub j: u32,
    /// The branch vector from i to j is x_j − x_i + H·shift; whole numbers.
    pub shift: Vector<D>,
}

/// All pairs whose gap is less than `margin` (length units), sorted by (i, j): a function of
/// positions and cell alone. The cell must be higher than two cut-off lengths.
pub(crate) fn pairs<const D: usize>(
    cell: &Cell<D>,
    inverse: &[[f64; D]; D],
    positions: &[Vector<D>],
    radii: &[f64],
    margin: f64,
) -> Vec<Pair<D>> {
    Simd::run(Near {
        cell,
        inverse,
        positions,
        radii,
        margin,
    })
}

struct Near<'a, const D: usize> {
    cell: &'a Cell<D>,
    inverse: &'a [[f64; D]; D],
    positions: &'a [Vector<D>],
    radii: &'a [f64],
    margin: f64,
}

impl<const D: usize> NullaryFnOnce for Near<'_, D> {
    type Output = Vec<Pair<D>>;

    #[inline(always)]
    fn call(self) -> Vec<Pair<D>> {
        near(self)
    }
}

#[inline(always)]
fn near<const D: usize>(near: Near<'_, D>) -> Vec<Pair<D>> {
    let Near {
        cell,
        inverse,
        positions,
        radii,
        margin,
    } = near;
    let largest = radii.iter().copied().fold(0.0, f64::max);
    let cutoff = 2.0 * largest + margin;
    let scaled: Vec<Vector<D>> = positions.iter().map(|x| apply(inverse, x)).collect();
    let bins = Bins::new(&cell.heights(), cutoff, &scaled);
    let mut found = Vec::with_capacity(3 * positions.len());
    for i in 0..positions.len() {
        bins.for_neighbours(i, |j| {
            if j <= i {
                return;
            }
            let mut shift = [0.0; D];
            for k in 0..D {
                shift[k] = -(scaled[j][k] - scaled[i][k]).round();
            }
            let image = cell.translation(&shift);
            let distance2: f64 = (0..D)
                .map(|k| positions[j][k] - positions[i][k] + image[k])
                .map(|d| d * d)
                .sum();
            let reach = radii[i] + radii[j] + margin;
            if distance2 < reach * reach {
                found.push(Pair {
                    i: i as u32,
                    j: j as u32,
                    shift,
                });
            }
        });
    }
    found.sort_unstable_by_key(|pair| (pair.i, pair.j));
    found
}

/// Grains sorted into bins of the cell, each at least one cut-off high.
struct Bins<const D: usize> {
    counts: [usize; D],
    bin_of: Vec<[usize; D]>,
    start: Vec<u32>,
    members: Vec<u32>,
}

impl<const D: usize> Bins<D> {
    fn new(heights: &Vector<D>, cutoff: f64, scaled: &[Vector<D>]) -> Self {
        // More bins than grains in a direction would only cost memory.
        let counts =
            heights.map(|height| ((height / cutoff) as usize).clamp(1, scaled.len().max(1)));
        let bin_of: Vec<[usize; D]> = scaled
            .iter()
            .map(|s| {
                let mut bin = [0; D];
                for k in 0..D {
                    let inside = s[k] - s[k].floor();
                    bin[k] = ((inside * counts[k] as f64) as usize).min(counts[k] - 1);
                }
                bin
            })
            .collect();
        let mut bins = Self {
            counts,
            bin_of,
            start: Vec::new(),
            members: Vec::new(),
        };
        let total = counts.iter().product::<usize>();
        let mut size = vec![0u32; total + 1];
        for bin in &bins.bin_of {
            size[bins.flat(bin) + 1] += 1;
        }
        for k in 0..total {
            size[k + 1] += size[k];
        }
        bins.start = size.clone();
        bins.members = vec![0; scaled.len()];
        for (grain, bin) in bins.bin_of.iter().enumerate() {
            let slot = &mut size[bins.flat(bin)];
            bins.members[*slot as usize] = grain as u32;
            *slot += 1;
        }
        bins
    }

    fn flat(&self, bin: &[usize; D]) -> usize {
        (0..D).fold(0, |flat, k| flat * self.counts[k] + bin[k])
    }

    /// Visits every grain in the bin of `grain` and the bins around it once.
    #[inline(always)]
    fn for_neighbours(&self, grain: usize, mut visit: impl FnMut(usize)) {
        let mut visited = [usize::MAX; 27];
        let mut count = 0;
        for code in 0..3usize.pow(D as u32) {
            let mut rest = code;
            let mut bin = self.bin_of[grain];
            for k in 0..D {
                bin[k] = (bin[k] + self.counts[k] + rest % 3 - 1) % self.counts[k];
                rest /= 3;
            }
            let flat = self.flat(&bin);
            // With fewer than three bins in a direction, neighbours coincide.
            if visited[..count].contains(&flat) {
                continue;
            }
            visited[count] = flat;
            count += 1;
            let members = self.start[flat] as usize..self.start[flat + 1] as usize;
            for &member in &self.members[members] {
                visit(member as usize);
            }
        }
    }
}
