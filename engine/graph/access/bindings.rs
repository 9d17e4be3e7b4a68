//! What a shader binds: kinds, shapes and texel formats must be those that it names.

use super::Collector;
use crate::{
    graph::{
        args::Bind,
        format::{Class, Format},
        handles::{Image, Sampler},
        pass::Bound,
        vocab::{Access, Layout, MistakeKind, Scope, Stages, Usage},
    },
    shader::{self, Binding, BindingKind, Dim, Stage, Texel},
};

/// Storage and uniform bindings start at multiples of this: the largest alignment that a device may ask for.
const BINDING_ALIGNMENT: u64 = 256;

impl Collector<'_> {
    pub(super) fn bound(&mut self, bound: &Bound) {
        let mut resources = bound.resources.iter();
        for binding in bound.shader.bindings {
            let mut stages = Stages::NONE;
            for stage in binding.stages {
                stages |= match stage {
                    Stage::Compute => Stages::COMPUTE,
                    Stage::Vertex => Stages::VERTEX,
                    Stage::Fragment => Stages::FRAGMENT,
                };
            }
            for element in 0..binding.count {
                let role = if binding.count > 1 { format!("{}[{element}]", binding.name) } else { binding.name.into() };
                let resource = resources.next();
                if let Some(Bind::Image(image)) = resource {
                    self.texels(*image, binding, &role);
                }
                match (binding.kind, resource) {
                    (BindingKind::Sampled(dim), Some(Bind::Image(image))) => {
                        self.sampled(*image, dim, stages, &role);
                    }
                    (BindingKind::Storage(dim), Some(Bind::Image(image))) => {
                        self.storage(*image, dim, stages, binding.access, &role);
                    }
                    (BindingKind::Buffer, Some(Bind::Buffer(buffer))) => {
                        self.buffer(*buffer, stages, storage_access(binding.access), Usage::STORAGE, &role);
                        if !buffer.offset.is_multiple_of(BINDING_ALIGNMENT) {
                            let what = format!(
                                "`{role}` starts at byte {}; a shader needs a multiple of {BINDING_ALIGNMENT}",
                                buffer.offset
                            );
                            self.mistake(MistakeKind::Range, self.buffer_name(*buffer), what);
                        }
                    }
                    (BindingKind::Uniform { size }, Some(Bind::Uniform(slice))) => {
                        if self.own(slice.graph, "uniform block") && slice.size < size {
                            let what = format!("the shader reads {size} bytes, but it has {}", slice.size);
                            self.mistake(MistakeKind::Shape, role, what);
                        }
                    }
                    (BindingKind::AccelerationStructure, Some(Bind::Accel(accel))) => {
                        self.traced(*accel, stages, &role);
                    }
                    _ => self.mistake(MistakeKind::Shape, role, "this kind of resource cannot be bound"),
                }
            }
        }
    }

    /// Format and kind of numbers must be those that the shader names.
    fn texels(&mut self, image: Image, binding: &Binding, role: &str) {
        let Some(desc) = self.desc(image) else { return };
        let texel = match desc.format.class() {
            Class::Uint => Texel::Uint,
            Class::Sint => Texel::Sint,
            Class::Float | Class::Depth | Class::DepthStencil => Texel::Float,
        };
        let wanted = Format::from_spirv(binding.format);
        let wrong = match wanted {
            _ if texel != binding.texel => format!("{:?} values", binding.texel),
            Some(format) if format != desc.format => format!("{format:?}"),
            _ => return,
        };
        let what = format!("`{role}` is {wrong} in the shader, but the image is {:?}", desc.format);
        self.mistake(MistakeKind::Format, self.image_name(image), what);
    }

    fn view(&mut self, image: Image, dim: Dim, role: &str) {
        let Some(desc) = self.desc(image) else { return };
        let wrong = match dim {
            Dim::D1 => Some("one-dimensional images do not exist here".to_owned()),
            Dim::D2 if desc.depth > 1 => Some("a volume is bound to a 2D image".to_owned()),
            Dim::D2 if image.layers != 1 => Some(format!("{} layers; choose one with `.layer(i)`", image.layers)),
            Dim::D3 if desc.depth <= 1 => Some("a flat image is bound to a volume".to_owned()),
            Dim::Cube if !desc.cube || image.layers != 6 => Some("it is no cube of six layers".to_owned()),
            Dim::CubeArray if !desc.cube || !image.layers.is_multiple_of(6) => {
                Some("it is no array of cubes".to_owned())
            }
            _ => None,
        };
        if let Some(wrong) = wrong {
            self.mistake(MistakeKind::Shape, self.image_name(image), format!("`{role}`: {wrong}"));
        }
    }

    fn sampled(&mut self, image: Image, dim: Dim, stages: Stages, role: &str) {
        self.view(image, dim, role);
        if let Some(desc) = self.desc(image)
            && image.sampler == Sampler::Shadow
            && !desc.format.is_depth()
        {
            let what = format!("`{role}` compares depths, but the format is {:?}", desc.format);
            self.mistake(MistakeKind::Format, self.image_name(image), what);
        }
        let scope = Scope { stages, access: Access::SAMPLED };
        self.image(image, scope, Layout::ShaderRead, Usage::SAMPLED, role);
    }

    fn storage(&mut self, image: Image, dim: Dim, stages: Stages, access: shader::Access, role: &str) {
        self.view(image, dim, role);
        self.one_level(image, "can be bound as storage image");
        if let Some(desc) = self.desc(image)
            && (desc.format.is_depth() || matches!(desc.format, Format::RGBA8Srgb | Format::BGRA8Srgb | Format::Raw(_)))
        {
            let what = format!("`{role}` is a storage image, which {:?} cannot be", desc.format);
            self.mistake(MistakeKind::Format, self.image_name(image), what);
        }
        let scope = Scope { stages, access: storage_access(access) };
        self.image(image, scope, Layout::General, Usage::STORAGE, role);
    }
}

fn storage_access(access: shader::Access) -> Access {
    match access {
        shader::Access::Read => Access::STORAGE_READ,
        shader::Access::Write => Access::STORAGE_WRITE,
        shader::Access::ReadWrite => Access::STORAGE_READ | Access::STORAGE_WRITE,
    }
}
