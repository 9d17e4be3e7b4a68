//! Equations for all pixels of a picture at once: the values whose differences along the edges between pixels are nearest to wanted ones.
//!
//! Minimises Σ w (x_i − x_j − g)² over the edges of one level of pixels, or of all levels of a pyramid of means of 2 × 2 pixels. That is
//! Ax = b with A = Σ_k D_kᵀ ∇ᵀ w_k ∇ D_k, D_k being the means; the border is free (Neumann), and the sum of x is free as well.
//!
//! The way: conjugate gradients, preconditioned by one V-cycle of a multigrid method for the edges alone. It halves sizes, rounded up, until
//! both are at most `TONEMAP_COARSE`; it relaxes red-black before and black-red after, and goes up by the transpose of how it goes down, so
//! that it is symmetric. All sums have a fixed order, so that a device gives the same bits each time.
//! Steps end where r · z (the squared error as the cycle sees it) is [`TOLERANCE`]² of its first value.

use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::{
        consts,
        tonemap::{
            solve_begin, solve_coarse, solve_couple, solve_dot, solve_flow, solve_mean, solve_prolong, solve_relax,
            solve_rest, solve_restrict, solve_scalar, solve_step, solve_turn,
        },
        types::TonemapSolve,
    },
};
use std::mem::offset_of;

/// Error of the differences of the solution, relative to the solution's own, at which the steps end.
pub const TOLERANCE: f32 = 3e-6;
/// Most steps.
const STEPS: u32 = 40;

/// Values along the edges to the right and below of each pixel, R32F each; 0 where no pixel follows.
#[derive(Clone, Copy, Debug)]
pub struct Edges {
    pub across: Image,
    pub down: Image,
}

impl Edges {
    /// Not yet written.
    pub fn new(graph: &mut Graph, name: &str, extent: Extent) -> Self {
        let mut image = |way| graph.image(format!("tonemap.{name}.{way}"), Format::R32F, extent);
        Self { across: image("across"), down: image("down") }
    }
}

/// The wanted differences.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// For each level, finest first: weight times wanted difference (the next pixel less this one).
    pub flows: Vec<Edges>,
    /// Weights for each level. Empty: one level, all weights 1.
    pub weights: Vec<Edges>,
}

/// Result of the solver.
#[derive(Clone, Copy, Debug)]
pub struct Solution {
    /// R32F.
    pub values: Image,
    /// One `types::TonemapSolve`.
    pub state: Buffer,
}

/// Extents of a pyramid from `extent` on, halved and rounded up as long as `goes_on` of the last.
pub fn extents(extent: Extent, goes_on: impl Fn(Extent) -> bool) -> Vec<Extent> {
    let next = |last: &Extent| goes_on(*last).then(|| last.div_ceil(2));
    std::iter::successors(Some(extent), next).collect()
}

/// Declares the passes that solve for `wanted`.
pub fn solve(graph: &mut Graph, wanted: &Wanted) -> Solution {
    graph.scope("solve", |graph| {
        let solver = Solver::new(graph, wanted);
        solver.run(graph, wanted)
    })
}

/// One level of the multigrid method.
struct Level {
    extent: Extent,
    /// `None`: all weights are 1.
    weights: Option<Edges>,
    right: Image,
    solution: Image,
    rest: Image,
}

/// One level of the pyramid of A.
struct Term {
    extent: Extent,
    weights: Option<Edges>,
    values: Image,
    flow: Image,
}

struct Solver {
    state: Buffer,
    sums: Buffer,
    means: Buffer,
    levels: Vec<Level>,
    terms: Vec<Term>,
}

/// Sums of [`dot`] over an image.
fn groups(extent: Extent) -> [u32; 2] {
    [extent.width.div_ceil(64), extent.height.div_ceil(consts::TONEMAP_DOT_ROWS)]
}

/// Empty state of a solver.
pub fn state(graph: &mut Graph) -> Buffer {
    let state = graph.buffer("tonemap.solve", size_of::<TonemapSolve>() as u64);
    graph.fill(state, 0);
    state
}

/// Use of a sum: the stage of `solve_scalar`, and the place of a mean.
#[derive(Clone, Copy, Debug)]
pub struct Sum {
    pub stage: u32,
    pub mean: u32,
    pub divisor: f32,
}

/// Room for the sums of [`dot`] over images of at most `extent`.
pub fn sums(graph: &mut Graph, extent: Extent) -> Buffer {
    let [x, y] = groups(extent);
    graph.buffer("tonemap.sums", 4 * u64::from(x) * u64::from(y))
}

/// Values that are summed over all pixels.
#[derive(Clone, Copy, Debug)]
pub enum Of {
    Values(Image),
    Products(Image, Image),
    /// Squares of differences.
    Difference(Image, Image),
}

/// Sums over all pixels; `sum` names the use of the result. `buffers`: state, room for sums, means.
pub fn dot(graph: &mut Graph, of: Of, buffers: [Buffer; 3], sum: &Sum) {
    let [solve, sums, means] = buffers;
    let (one, two, product) = match of {
        Of::Values(one) => (one, one, 0),
        Of::Products(one, two) => (one, two, 1),
        Of::Difference(one, two) => (one, two, 2),
    };
    let extent = graph.extent(one);
    let [x, y] = groups(extent);
    let spec = solve_dot::Spec { product };
    graph.compute(solve_dot::Args { one, two, solve, sums, spec }, [extent.width, y]);
    let (tolerance, Sum { stage, mean, divisor }) = (TOLERANCE * TOLERANCE, *sum);
    let push = solve_scalar::Push { count: x * y, stage, tolerance, divisor, mean };
    // One group.
    graph.compute(solve_scalar::Args { sums, solve, means, push }, 1);
}

impl Solver {
    fn new(graph: &mut Graph, wanted: &Wanted) -> Self {
        let extent = graph.extent(wanted.flows[0].across);
        let image = |graph: &mut Graph, name: &str, k: usize, extent| {
            graph.image(format!("tonemap.solve.{name}{k}"), Format::R32F, extent)
        };
        let terms = wanted.flows.iter().enumerate().map(|(k, flow)| {
            let extent = graph.extent(flow.across);
            let weights = wanted.weights.get(k).copied();
            Term { extent, weights, values: image(graph, "term", k, extent), flow: image(graph, "flow", k, extent) }
        });
        let terms: Vec<Term> = terms.collect();
        let coarse = |e: Extent| e.width.max(e.height) <= consts::TONEMAP_COARSE;
        let mut levels: Vec<Level> = Vec::new();
        for (k, extent) in extents(extent, |e| !coarse(e)).into_iter().enumerate() {
            let weights = match levels.last() {
                None => wanted.weights.first().copied(),
                Some(fine) => Some(couple(graph, fine, extent, wanted.weights.get(k).copied(), wanted.flows[0])),
            };
            let [right, solution, rest] = ["right", "solution", "rest"].map(|name| image(graph, name, k, extent));
            levels.push(Level { extent, weights, right, solution, rest });
        }
        let means = graph.buffer("tonemap.solve.means", 4);
        Self { state: state(graph), sums: sums(graph, extent), means, levels, terms }
    }

    fn dot(&self, graph: &mut Graph, one: Image, two: Image, stage: u32) {
        let sum = Sum { stage, mean: 0, divisor: 1.0 };
        dot(graph, Of::Products(one, two), [self.state, self.sums, self.means], &sum);
    }

    fn run(&self, graph: &mut Graph, wanted: &Wanted) -> Solution {
        let extent = self.levels[0].extent;
        let mut image = |name: &str| graph.image(format!("tonemap.solve.{name}"), Format::R32F, extent);
        let [right, values, direction] = ["wanted", "values", "direction"].map(&mut image);
        self.flow(graph, None, Some(&wanted.flows), right);
        self.dot(graph, right, right, consts::TONEMAP_SOLVE_RIGHT);
        graph.clear(values, [0.0; 4]);
        let rest = self.levels[0].right;
        graph.copy(right, rest);
        self.cycle(graph, 0);
        let steepest = self.levels[0].solution;
        self.dot(graph, rest, steepest, consts::TONEMAP_SOLVE_FIRST);
        graph.copy(steepest, direction);
        let (solve, image) = (self.state, self.terms[0].flow);
        for _ in 0..STEPS {
            self.flow(graph, Some(direction), None, image);
            self.dot(graph, direction, image, consts::TONEMAP_SOLVE_STEP);
            graph.compute(solve_step::Args { direction, image, solve, solution: values, rest }, extent);
            self.cycle(graph, 0);
            self.dot(graph, rest, steepest, consts::TONEMAP_SOLVE_NEXT);
            graph.compute(solve_turn::Args { steepest, solve, direction }, extent);
        }
        // The residual is computed from the solution, because the steps only update an estimate of it, with rounding errors.
        let done = offset_of!(TonemapSolve, done) as u64;
        graph.fill(solve.range(done..done + 4), 0);
        self.flow(graph, Some(values), None, image);
        let left = Sum { stage: consts::TONEMAP_SOLVE_RESIDUAL, mean: 0, divisor: 1.0 };
        dot(graph, Of::Difference(right, image), [solve, self.sums, self.means], &left);
        Solution { values, state: solve }
    }

    /// A of `values`, or the right side of `given` flows, to `out`.
    fn flow(&self, graph: &mut Graph, values: Option<Image>, given: Option<&[Edges]>, out: Image) {
        let (solve, last) = (self.state, self.terms.len() - 1);
        let mut pyramid: Vec<Image> = values.into_iter().collect();
        if let Some(&first) = pyramid.first() {
            let mut fine = first;
            for term in &self.terms[1..] {
                graph.compute(solve_mean::Args { fine, solve, coarse: term.values }, term.extent);
                fine = term.values;
                pyramid.push(fine);
            }
        }
        for (k, term) in self.terms.iter().enumerate().rev() {
            let edges = given.map_or(term.weights, |flows| Some(flows[k]));
            // A binding needs an image. The shader does not read this one, so any written image will do.
            let Some(any) = pyramid.get(k).copied().or(edges.map(|edges| edges.across)) else { continue };
            let args = solve_flow::Args {
                values: any,
                across: edges.map_or(any, |edges| edges.across),
                down: edges.map_or(any, |edges| edges.down),
                coarse: if k < last { self.terms[k + 1].flow } else { any },
                solve,
                flow: if k == 0 { out } else { term.flow },
                spec: solve_flow::Spec {
                    ones: edges.is_none().into(),
                    has_coarse: (k < last).into(),
                    given: given.is_some().into(),
                },
            };
            graph.compute(args, term.extent);
        }
    }

    /// One V-cycle from level `k` on: an approximate solution for its right side.
    fn cycle(&self, graph: &mut Graph, k: usize) {
        let Level { extent, weights, right, solution, rest } = self.levels[k];
        let (solve, ones) = (self.state, weights.is_none().into());
        let [across, down] = weights.map_or([right, right], |edges| [edges.across, edges.down]);
        let Some(coarse) = self.levels.get(k + 1) else {
            let spec = solve_coarse::Spec { ones };
            let side = consts::TONEMAP_COARSE;
            graph.compute(solve_coarse::Args { right, across, down, solve, solution, spec }, [side, side]);
            return;
        };
        let half = [extent.width.div_ceil(2), extent.height];
        let relax = |graph: &mut Graph, colour| {
            let (push, spec) = (solve_relax::Push { colour }, solve_relax::Spec { ones });
            graph.compute(solve_relax::Args { right, across, down, solve, solution, push, spec }, half);
        };
        let spec = solve_begin::Spec { ones };
        graph.compute(solve_begin::Args { right, across, down, solve, solution, spec }, extent);
        relax(graph, 1);
        let spec = solve_rest::Spec { ones };
        graph.compute(solve_rest::Args { right, across, down, solve, solution, rest, spec }, extent);
        graph.compute(solve_restrict::Args { rest, solve, coarse: coarse.right }, coarse.extent);
        self.cycle(graph, k + 1);
        graph.compute(solve_prolong::Args { coarse: coarse.solution, solve, solution }, extent);
        relax(graph, 1);
        relax(graph, 0);
    }
}

/// Weights of the level of `extent` below `fine`, with its `own`.
fn couple(graph: &mut Graph, fine: &Level, extent: Extent, own: Option<Edges>, any: Edges) -> Edges {
    let coarse = Edges::new(graph, "solve.weights", extent);
    let Extent { width, height, .. } = fine.extent;
    // A binding needs an image; the shader does not read `any`.
    let (Edges { across, down }, added) = (fine.weights.unwrap_or(any), own.unwrap_or(any));
    let args = solve_couple::Args {
        across,
        down,
        own_across: added.across,
        own_down: added.down,
        coarse_across: coarse.across,
        coarse_down: coarse.down,
        push: solve_couple::Push { fine: [width as i32, height as i32] },
        spec: solve_couple::Spec { ones: fine.weights.is_none().into(), has_own: own.is_some().into() },
    };
    graph.compute(args, extent);
    coarse
}
