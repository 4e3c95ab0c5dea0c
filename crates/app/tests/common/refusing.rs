//! A Vulkan driver that finds a device and then fails to create it, as a broken or outdated driver does: the software
//! driver of this machine behind a small library that refuses one call.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// The library. It answers the loader in the name of the driver in `REAL_DRIVER`.
const LIBRARY: &str = r#"
#include <dlfcn.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef void (*Call)(void);
typedef Call (*Find)(void *instance, const char *name);
typedef int (*Negotiate)(uint32_t *version);

static void *driver(void) {
    static void *loaded;
    if (!loaded) loaded = dlopen(getenv("REAL_DRIVER"), RTLD_NOW);
    return loaded;
}

static int refuse(void *device, const void *info, const void *allocator, void *made) {
    return -3; /* VK_ERROR_INITIALIZATION_FAILED */
}

Call vk_icdGetInstanceProcAddr(void *instance, const char *name) {
    if (!strcmp(name, "vkCreateDevice")) return (Call)refuse;
    return ((Find)dlsym(driver(), "vk_icdGetInstanceProcAddr"))(instance, name);
}

Call vk_icdGetPhysicalDeviceProcAddr(void *instance, const char *name) {
    return ((Find)dlsym(driver(), "vk_icdGetPhysicalDeviceProcAddr"))(instance, name);
}

int vk_icdNegotiateLoaderICDInterfaceVersion(uint32_t *version) {
    return ((Negotiate)dlsym(driver(), "vk_icdNegotiateLoaderICDInterfaceVersion"))(version);
}
"#;

/// Makes a command use such a driver, which is built in a folder. Returns None where there is no software driver to
/// build it on.
///
/// # Panics
/// When there is a software driver but no C compiler.
pub(crate) fn make_driver_refuse<'a>(command: &'a mut Command, folder: &Path) -> Option<&'a mut Command> {
    let real = software_driver()?;
    let [source, library, entry] = ["driver.c", "driver.so", "driver.json"].map(|name| folder.join(name));
    fs::write(&source, LIBRARY).expect("written");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-w", "-o"]).arg(&library).arg(&source).arg("-ldl").stdin(Stdio::null());
    assert!(compiler.status().expect("a C compiler").success(), "the library compiles");
    let text = format!(
        r#"{{ "file_format_version": "1.0.0", "ICD": {{ "api_version": "1.1.0", "library_path": "{}" }} }}"#,
        library.display()
    );
    fs::write(&entry, text).expect("written");
    command.env("REAL_DRIVER", real).env("WGPU_BACKEND", "vulkan");
    Some(command.env("VK_DRIVER_FILES", &entry).env("VK_ICD_FILENAMES", &entry))
}

/// The library of the software driver, which the loader finds by an entry in a folder of the system.
fn software_driver() -> Option<PathBuf> {
    let entries = fs::read_dir("/usr/share/vulkan/icd.d").ok()?;
    let entry = entries.flatten().find(|entry| entry.file_name().to_string_lossy().starts_with("lvp_icd"))?;
    let text = fs::read_to_string(entry.path()).ok()?;
    let (_, rest) = text.split_once("\"library_path\"")?;
    Some(rest.split('"').nth(1)?.into())
}
