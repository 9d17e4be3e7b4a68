//! Compiles the two shaders of the user interface.

use std::{env, error::Error, fs, path::PathBuf};

const FOLDER: &str = "src/vulkan/shaders";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed={FOLDER}");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=SHADERC_LIB_DIR");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let compiler = shaderc::Compiler::new()?;
    let mut options = shaderc::CompileOptions::new()?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
    for (name, kind) in [("paint.vert", shaderc::ShaderKind::Vertex), ("paint.frag", shaderc::ShaderKind::Fragment)] {
        let source = fs::read_to_string(PathBuf::from(FOLDER).join(name))?;
        let code = compiler.compile_into_spirv(&source, kind, name, "main", Some(&options))?;
        fs::write(out.join(format!("{name}.spv")), code.as_binary_u8())?;
    }
    Ok(())
}
