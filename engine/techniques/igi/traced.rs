//! `Args` of passes that trace rays and light the surfaces that they hit.

/// Like [`traced!`](crate::rays::traced), and also fills in the environment and the settings block from `shared`. With `lamps` as the last
/// argument it fills in the bindings of `lib/lights.glsl` and `lib/light_sampling.glsl`, too.
macro_rules! traced_lit {
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr, $shared:expr $(,)?) => {
        $crate::rays::traced!(
            $($name)::+ {
                environment_radiance_map: $shared.environment,
                environment_edges: $shared.environment_edges,
                settings: $shared.settings,
                $($fields)*
            },
            $rays,
            $handles
        )
    };
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr, $shared:expr, lamps $(,)?) => {
        traced_lit!(
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
