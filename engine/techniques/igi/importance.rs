//! Importance resampling of virtual lights: light paths leave more candidates than needed, and the frame draws its virtual lights among
//! them with a probability that follows the light that they send to the view. Georgiev and Slusallek 2010 reject candidates; this
//! implementation draws by systematic resampling, in equal steps through the running sum of the weights.

use super::{Igi, Settings, Shared, Vpls, halton};
use crate::{
    graph::Graph,
    passes::gbuffer::GBuffer,
    shaders::{
        igi::{cumulate, importance, points, resample},
        types,
    },
};

/// Distance to a point below which a candidate's light is damped, as share of the scene's diagonal. Without it a candidate next to a
/// point would get nearly all the probability.
const NEAR: f32 = 0.03;

impl Igi {
    /// Draws the virtual lights among the candidates. The flux of a drawn light is divided by its expected number of draws, so that the
    /// estimate is unbiased.
    pub(super) fn choose(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        candidates: Vpls,
        settings: &Settings,
    ) -> Vpls {
        let count = settings.paths() * settings.bounces;
        let seen = graph.buffer("igi.points", u64::from(settings.judges) * size_of::<types::SeenPoint>() as u64);
        let args = points::Args {
            view: g.view,
            albedo: g.albedo,
            normal: g.normal,
            depth: g.depth,
            points: seen,
            push: points::Push { count: settings.judges },
        };
        graph.compute(args, settings.judges);
        let total = candidates.count;
        let floats = 4 * u64::from(total);
        let importances = graph.buffer("igi.importances", floats);
        graph.fill(importances, 0);
        let push = importance::Push { total, near: NEAR * shared.diagonal, seed: shared.seed, ..Default::default() };
        let args = crate::rays::traced!(
            importance::Args { candidates: candidates.buffer, points: seen, importances, push },
            shared.rays
        );
        graph.compute_over(args, total, self.items(settings.judges, total.into()));
        let (weights, sums) = (graph.buffer("igi.weights", floats), graph.buffer("igi.sums", floats));
        let push = cumulate::Push { total };
        graph.compute(cumulate::Args { candidates: candidates.buffer, importances, weights, sums, push }, 1);
        let vpls = graph.buffer("igi.vpls", u64::from(count) * size_of::<types::Vpl>() as u64);
        let offset = if shared.seed == 0 { 0.5 } else { halton::shift(shared.seed, u32::MAX - 1) as f32 };
        // Rounding to 32 bits may yield 1, which is outside of the range.
        let offset = offset.min(1.0 - f32::EPSILON / 2.0);
        let push = resample::Push { total, count, offset };
        graph.compute(resample::Args { candidates: candidates.buffer, weights, sums, vpls, push }, count);
        Vpls { buffer: vpls, count, tree: None }
    }
}
