//! Shader modules.

use ash::vk;

use super::device::Context;
use crate::{
    Error, ErrorKind, Result,
    shader::{Shader, StageCode},
};

/// The SPIR-V of a stage.
#[cfg(not(feature = "replaceable-shaders"))]
fn module_of(code: &StageCode) -> Result<std::borrow::Cow<'static, [u8]>> {
    Ok(code.spirv.into())
}

/// The SPIR-V of a stage: a file of its name in the folder that the variable `LUCERNA_SHADERS` names, if there is one, takes its place.
#[cfg(feature = "replaceable-shaders")]
fn module_of(code: &StageCode) -> Result<std::borrow::Cow<'static, [u8]>> {
    let Some(folder) = std::env::var_os("LUCERNA_SHADERS") else { return Ok(code.spirv.into()) };
    let file = std::path::Path::new(&folder).join(code.file);
    match std::fs::read(&file) {
        Ok(bytes) => Ok(bytes.into()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(code.spirv.into()),
        Err(error) => Err(Error::input("a shader cannot be read").caused_by(error).in_file(file)),
    }
}

/// Shader modules, needed only while a pipeline is made.
pub(super) struct Modules<'a> {
    context: &'a Context,
    list: Vec<vk::ShaderModule>,
}

impl<'a> Modules<'a> {
    pub(super) fn new(context: &'a Context, shader: &Shader) -> Result<Self> {
        let mut modules = Self { context, list: Vec::new() };
        for code in shader.stages {
            let (stage, spirv) = (code.stage, module_of(code)?);
            if spirv.len() % 4 != 0 {
                return Err(Error::new(
                    ErrorKind::Runtime,
                    format!("the SPIR-V of shader `{}` has {} bytes", shader.name, spirv.len()),
                ));
            }
            // A byte slice need not be aligned for words.
            let words: Vec<u32> = spirv.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            // SAFETY: the code was made and checked by the compiler at build time.
            let made = unsafe { context.device.create_shader_module(&info, None) };
            modules.list.push(
                context.check(made, || {
                    format!("vkCreateShaderModule for the {stage:?} stage of shader `{}`", shader.name)
                })?,
            );
        }
        Ok(modules)
    }

    /// One module a stage, in the order of the shader's stages.
    pub(super) fn list(&self) -> &[vk::ShaderModule] {
        &self.list
    }
}

impl Drop for Modules<'_> {
    fn drop(&mut self) {
        for module in &self.list {
            // SAFETY: pipelines do not need their modules once made.
            unsafe { self.context.device.destroy_shader_module(*module, None) };
        }
    }
}
