//! Lets a plain `cargo build` link the library where the linker asks for Python's symbols (macOS).

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
