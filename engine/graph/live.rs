//! Passes whose shaders are known at run time alone.

use super::{
    Graph,
    args::Bind,
    build::PassRef,
    format::{Extent, Threads},
    pass::{Bound, Groups, Work},
    raster::{Draw, Raster, Targets},
};

impl Graph {
    /// Draws one triangle over whole targets with a shader that is known at run time alone. `constants`: the bytes of its push constants, and its
    /// specialisation constants.
    pub(crate) fn draw_over(
        &mut self,
        shader: &'static crate::shader::Shader,
        targets: Targets,
        resources: Vec<Bind>,
        (push, spec): (Vec<u8>, Vec<u32>),
    ) -> PassRef<'_> {
        let bound = Bound { shader, resources, push, spec };
        self.pass(shader.name, Work::Raster { bound, targets, state: Raster::new(), draw: Draw::fullscreen() })
    }

    /// As [`Self::draw_over`], for a compute shader with a thread for each pixel.
    pub(crate) fn dispatch(
        &mut self,
        shader: &'static crate::shader::Shader,
        resources: Vec<Bind>,
        (push, spec): (Vec<u8>, Vec<u32>),
        threads: Extent,
    ) -> PassRef<'_> {
        let threads = Threads::from(threads).0;
        let groups = [0, 1, 2].map(|i| threads[i].div_ceil(shader.workgroup[i].max(1)));
        let bound = Bound { shader, resources, push, spec };
        self.pass(shader.name, Work::Compute { bound, groups: Groups::Direct(groups), over: None })
    }
}
