//! What a shader is to the engine: its code and its interface, both taken from the GLSL by `build.rs`.
//!
//! The GLSL file is the only description of a pass. `build.rs` compiles every entry shader under `shaders-glsl/`, reads its
//! interface from the SPIR-V, and writes one Rust module per pass into [`crate::shaders`]: `Args` (a named field for each
//! binding), `Push`, `Spec` and the workgroup size. A forgotten binding is a missing field and does not compile.
//! `readonly` and `writeonly` in the GLSL are the access declarations from which the render graph derives barriers.

// Used by build.rs as well; in the library only their tests and the types below are needed.
#[cfg(test)]
mod codegen;
#[cfg(any(test, feature = "effects"))]
#[allow(dead_code)]
pub(crate) mod compile;
#[cfg(any(test, feature = "effects"))]
#[allow(dead_code)]
pub(crate) mod reflect;
#[cfg(test)]
mod variants;

/// A compute or raster program: all its stages, and what it binds.
#[derive(Debug)]
pub struct Shader {
    /// `technique.pass`, from the path of the file.
    pub name: &'static str,
    /// One compute stage, or a vertex stage with or without a fragment stage.
    pub stages: &'static [StageCode],
    /// Sorted by binding number; all in descriptor set 0.
    pub bindings: &'static [Binding],
    /// Bytes of the push-constant block over all stages; 0 if there is none.
    pub push_size: u32,
    /// Compute: threads of a workgroup.
    pub workgroup: [u32; 3],
    /// Sorted by id.
    pub spec: &'static [SpecConstant],
    /// Raster: colour attachments that the fragment stage writes (highest location + 1).
    pub color_outputs: u32,
    /// It traces by ray query: only for devices that have it.
    pub ray_query: bool,
    /// The same pass, tracing by ray query instead of in compute.
    pub query: Option<&'static Shader>,
}

/// One stage of a [`Shader`].
#[derive(Debug)]
pub struct StageCode {
    pub stage: Stage,
    /// Name of the module's file, for example `igi.gather.comp.spv`.
    pub file: &'static str,
    /// Optimised SPIR-V, little endian, a multiple of four bytes, entry point `main`.
    pub spirv: &'static [u8],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    Compute,
    Vertex,
    Fragment,
}

/// Number of the specialisation constant that the engine sets itself, for every shader: 1 where
/// [`crate::gpu::Caps::ordered_rays`]. build.rs leaves it out of the interface.
pub(crate) const ENGINE_SPEC: u32 = 31;
#[cfg(any(test, feature = "effects"))]
const _: () = assert!(ENGINE_SPEC == reflect::ENGINE_SPEC.0);

/// A resource that a shader binds.
#[derive(Debug)]
pub struct Binding {
    /// As the field in `Args`.
    pub name: &'static str,
    pub binding: u32,
    pub kind: BindingKind,
    pub access: Access,
    pub stages: &'static [Stage],
    /// Elements of an array of resources; 1 otherwise.
    pub count: u32,
    /// Images: what a texel is to the shader.
    pub texel: Texel,
    /// Storage images: the format that the shader names, by its number in SPIR-V; 0: none.
    pub format: u32,
}

/// What a texel is to a shader: `vec4`, `uvec4` or `ivec4`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Texel {
    /// The resource is no image.
    None,
    /// Floats, normalised integers and depth.
    Float,
    Uint,
    Sint,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// Combined image and sampler.
    Sampled(Dim),
    /// Storage image.
    Storage(Dim),
    /// Storage buffer.
    Buffer,
    /// Uniform buffer of this many bytes.
    Uniform {
        size: u32,
    },
    AccelerationStructure,
}

/// Shape of the view that a shader expects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dim {
    D1,
    D2,
    D2Array,
    D3,
    Cube,
    CubeArray,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    Read,
    Write,
    ReadWrite,
}

/// A specialisation constant; four bytes each.
#[derive(Debug)]
pub struct SpecConstant {
    pub name: &'static str,
    pub id: u32,
}
