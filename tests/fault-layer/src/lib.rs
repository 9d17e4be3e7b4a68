//! Vulkan fault-injection layer (tests only).
