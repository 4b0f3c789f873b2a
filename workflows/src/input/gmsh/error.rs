//! What can be wrong with a mesh file.

use std::fmt;

use solver_fem::mesh::MeshProblem;

/// One fault of a mesh file. Numbers of nodes and elements are those of the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GmshError {
    /// The bytes are no mesh file.
    #[error("it is no mesh file of Gmsh: it does not begin with `$MeshFormat`")]
    NotGmsh,
    /// A version that is not read.
    #[error("it has format {found}; formats 4.1 and 2.2 are read")]
    Version {
        /// The version it states.
        found: String,
    },
    /// Something in the bytes is not what the format says.
    #[error("{place}: {what}")]
    Syntax {
        /// Where: section, and line or byte.
        place: String,
        /// What is wrong.
        what: String,
    },
    /// A section that is needed is not there.
    #[error("it has no section `${section}`")]
    NoSection {
        /// Name of the section.
        section: &'static str,
    },
    /// The mesh is cut into partitions.
    #[error("the mesh is cut into partitions")]
    Partitioned,
    /// There are no plane elements.
    #[error("it has no triangles or quadrangles")]
    NoPlaneElements,
    /// There are volume elements.
    #[error("element {element} is a {kind}: a plane mesh is needed")]
    Volume {
        /// The first of them.
        element: u64,
        /// What it is.
        kind: &'static str,
    },
    /// An element that is not computed with.
    #[error("element {element} is a {kind}{why}")]
    Unsupported {
        /// The first of them.
        element: u64,
        /// What it is.
        kind: &'static str,
        /// Why not; empty or beginning with a comma.
        why: &'static str,
    },
    /// Several kinds of elements.
    #[error(
        "it mixes kinds of elements: element {first} is a {first_kind}, element {second} a {second_kind}"
    )]
    Mixed {
        /// The first element.
        first: u64,
        /// What it is.
        first_kind: &'static str,
        /// The first of another kind.
        second: u64,
        /// What that is.
        second_kind: &'static str,
    },
    /// An element refers to a node that is not there.
    #[error("element {element} refers to node {node}, which is not in the file")]
    UnknownNode {
        /// The element.
        element: u64,
        /// The node.
        node: u64,
    },
    /// Two nodes have the same number.
    #[error("there are two nodes {node}")]
    NodeTwice {
        /// The number.
        node: u64,
    },
    /// The mesh is not in the plane of x and y.
    #[error(
        "node {node} lies at z = {z}, others at {plane}: the mesh must lie in the plane of x and y"
    )]
    NotPlane {
        /// The node.
        node: u64,
        /// Its z.
        z: f64,
        /// That of the first node.
        plane: f64,
    },
    /// A line of a group is no side of an element.
    #[error("line {line} of the group `{group}` is no side of an element")]
    StrayLine {
        /// The line.
        line: u64,
        /// Its group.
        group: String,
    },
    /// A point of a group belongs to no element.
    #[error("node {node} of the group `{group}` belongs to no element")]
    StrayPoint {
        /// The node.
        node: u64,
        /// The group.
        group: String,
    },
    /// Two groups with one name, of different or the same dimension.
    #[error(
        "there are two groups `{name}`, {first} and {second}: conditions could not tell them apart"
    )]
    NameTwice {
        /// The name.
        name: String,
        /// What the first is.
        first: &'static str,
        /// What the second is.
        second: &'static str,
    },
    /// More elements than can be computed with.
    #[error("it has {found} elements, at most {most} can be handled")]
    TooMany {
        /// How many.
        found: usize,
        /// The most.
        most: usize,
    },
    /// What the macro solver finds wrong with the mesh.
    #[error("{}", mesh_problem(.problem, .elements, .nodes))]
    Mesh {
        /// The fault, in the numbers of the mesh that was made.
        problem: MeshProblem,
        /// Numbers in the file of the elements it names.
        elements: Vec<u64>,
        /// Numbers in the file of the nodes it names.
        nodes: Vec<u64>,
    },
}

impl GmshError {
    /// What would be right.
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::NotGmsh => "Gmsh writes such files by `gmsh -2 shape.geo -o shape.msh`",
            Self::Version { .. } => "save it with `Mesh.MshFileVersion = 4.1;`",
            Self::Syntax { .. } | Self::NoSection { .. } => {
                "was it cut off or edited? write it again with Gmsh"
            }
            Self::Partitioned => {
                "save it without: `Mesh.PartitionSplitMeshFiles` and `PartitionMesh` left out"
            }
            Self::NoPlaneElements => {
                "mesh the surface (`gmsh -2`); with physical groups, Gmsh saves only what is in one: put the surface into a `Physical Surface`, too"
            }
            Self::Volume { .. } => "mesh in two dimensions only: `gmsh -2`",
            Self::Unsupported { .. } => {
                "ask for quadratic elements: `Mesh.ElementOrder = 2; Mesh.SecondOrderIncomplete = 1;`"
            }
            Self::Mixed { .. } => {
                "leave `Recombine` out for triangles alone, or mesh with `Mesh.RecombinationAlgorithm = 3;` or `Mesh.SubdivisionAlgorithm = 1;` for quadrangles alone"
            }
            Self::NotPlane { .. } => "give all points the same z",
            Self::StrayLine { .. } | Self::StrayPoint { .. } => {
                "does the surface contain it? `Coherence;` joins what is drawn twice, a line inside must be embedded: `Line{…} In Surface{…};`"
            }
            Self::NameTwice { .. } => "give each group its own name",
            Self::Mesh { problem, .. } => match problem {
                MeshProblem::CoincidentNodes { .. } | MeshProblem::LoosePiece { .. } => {
                    "the geometry holds points or lines twice; `Coherence;` (or `BooleanFragments`) before meshing joins them"
                }
                MeshProblem::HangingNode { .. }
                | MeshProblem::Overlap { .. }
                | MeshProblem::OverfullSide { .. } => {
                    "neighbouring surfaces must share their lines; `Coherence;` (or `BooleanFragments`) before meshing sees to it"
                }
                MeshProblem::Inverted { .. }
                | MeshProblem::Folded { .. }
                | MeshProblem::ZeroArea { .. } => {
                    "mesh finer there, or let Gmsh untangle the mesh: `Mesh.HighOrderOptimize = 2;`"
                }
                _ => return None,
            },
            Self::UnknownNode { .. } | Self::NodeTwice { .. } | Self::TooMany { .. } => {
                return None;
            }
        })
    }
}

/// The fault as the solver tells it, and the numbers that a user of Gmsh can look up.
fn mesh_problem(problem: &MeshProblem, elements: &[u64], nodes: &[u64]) -> String {
    let numbers = |what: &str, tags: &[u64]| match tags {
        [] => None,
        [one] => Some(format!("{what} {one}")),
        several => {
            let tags: Vec<String> = several.iter().map(ToString::to_string).collect();
            Some(format!("{what}s {}", tags.join(", ")))
        }
    };
    let named: Vec<String> = [numbers("element", elements), numbers("node", nodes)]
        .into_iter()
        .flatten()
        .collect();
    match named.is_empty() {
        true => problem.to_string(),
        false => format!("{problem} (in the file: {})", named.join(", ")),
    }
}

/// All that is wrong with a mesh file; at least one fault.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshErrors(pub Vec<GmshError>);

impl From<GmshError> for GmshErrors {
    fn from(error: GmshError) -> Self {
        Self(vec![error])
    }
}

impl std::error::Error for GmshErrors {}

impl fmt::Display for GmshErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all: Vec<String> = self.0.iter().map(ToString::to_string).collect();
        f.write_str(&all.join("; "))
    }
}
