//! `Args` of passes that trace rays, without a list of bindings at each.

/// `Args` with the fields given and those of `lib/trace.glsl` and `lib/material.glsl` from `rays` ([`crate::rays::RayHandles`]); also those
/// of `lib/hit_surface.glsl` where the scene's `handles` are given; also the environment and the pass's settings where `shared` is;
/// with `lamps` in the last place those of `lib/lights.glsl` and `lib/light_sampling.glsl`.
macro_rules! traced {
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr $(,)?) => {{
        let rays: $crate::rays::RayHandles = $rays;
        $($name)::+ {
            materials: rays.materials,
            scene_textures: rays.scene_textures,
            trace_nodes: rays.trace_nodes,
            trace_triangles: rays.trace_triangles,
            trace_instances: rays.trace_instances,
            trace_indices: rays.trace_indices,
            trace_uvs: rays.trace_uvs,
            trace_colors: rays.trace_colors,
            trace_scene: rays.trace_scene,
            trace_accel: rays.trace_accel,
            $($fields)*
        }
    }};
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr $(,)?) => {
        traced!(
            $($name)::+ {
                surface_instances: $handles.instances,
                surface_indices: $handles.indices,
                surface_positions: $handles.positions,
                surface_normals: $handles.normals,
                surface_tangents: $handles.tangents,
                surface_uvs: $handles.uvs,
                surface_colors: $handles.colors,
                $($fields)*
            },
            $rays
        )
    };
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr, $shared:expr $(,)?) => {
        traced!(
            $($name)::+ {
                environment_radiance_map: $shared.environment,
                environment_columns: $shared.environment_columns,
                settings: $shared.settings,
                $($fields)*
            },
            $rays,
            $handles
        )
    };
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr, $shared:expr, lamps $(,)?) => {
        traced!(
            $($name)::+ {
                light_columns: $shared.light_columns,
                light_targets: $shared.light_targets,
                instance_lights: $shared.instance_lights,
                light_nodes: $shared.light_nodes,
                lights: $handles.lights,
                $($fields)*
            },
            $rays,
            $handles,
            $shared
        )
    };
}
