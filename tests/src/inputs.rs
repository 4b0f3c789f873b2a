//! Small problems that take seconds.

/// A biaxial test of 2 × 4 elements with a gallery of three packings, so that it is neither homogeneous nor
/// prepared in one task: 8 element tasks (32 REVs) a wave, `steps` load steps of 5e-4 axial strain.
pub fn biaxial(name: &str, grains: u32, steps: u32) -> String {
    let end = -1e-3 * f64::from(steps);
    format!(
        "name: {name}
mesh:
  rectangle: {{ size: [1.0, 2.0], elements: [2, 4] }}
materials:
  sand: {{ rev: {{ grains: {grains}, packings: {{ gallery: 3 }}, seed: 7 }} }}
loads: {{ shortening: 0.0 }}
boundary:
  - {{ on: bottom, displacement: {{ y: 0 }} }}
  - {{ on: bottom_mid, displacement: {{ x: 0 }} }}
  - {{ on: top, displacement: {{ y: shortening }} }}
  - {{ on: left, pressure: 1.0 }}
  - {{ on: right, pressure: 1.0 }}
programme:
  - {{ name: compression, ramp: {{ shortening: {end} }}, steps: {steps} }}
"
    )
}

/// The least body: one element of four REVs with two packings of 20 grains, `steps` load steps. A tenth of a second.
pub fn least(name: &str, steps: u32) -> String {
    biaxial(name, 20, steps)
        .replace(
            "size: [1.0, 2.0], elements: [2, 4]",
            "size: [1.0, 1.0], elements: [1, 1]",
        )
        .replace("gallery: 3", "gallery: 2")
}

/// [`biaxial`] with a second gradient.
pub fn biaxial_with_second_gradient(name: &str, grains: u32, steps: u32) -> String {
    format!(
        "{}second_gradient: {{ D: 6.4e-3 }}\n",
        biaxial(name, grains, steps)
    )
}

/// [`biaxial`] with a macro solver that is given two iterations a step only: most steps are cut, some several times.
pub fn biaxial_with_cuts(name: &str, grains: u32, steps: u32) -> String {
    let solver =
        "solver: { iterations: 2, relaxation_iterations: 0, loosest_force_tolerance: 1e-3 }";
    format!("{}{solver}\n", biaxial(name, grains, steps))
}

/// [`biaxial`], pressed and released until the force on its top has fallen by 0.3 of its peak, and pressed again.
pub fn biaxial_with_a_drop(name: &str, grains: u32) -> String {
    let input = biaxial(name, grains, 1);
    let (body, _) = input.split_once("programme:").expect("it has a programme");
    format!(
        "{body}programme:
  - {{ name: and back, cycle: {{ shortening: [-4e-3, 0.0] }}, steps: 5, until: [{{ force: top, along: y, drop: 0.3 }}] }}
  - {{ name: again, ramp: {{ shortening: -4e-3 }}, steps: 2 }}
"
    )
}
