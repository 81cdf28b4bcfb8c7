#include "machine/module/module.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <string>
#include <system_error>

namespace trammel::machine {
namespace {

namespace fs = std::filesystem;

template <class Function>
Function* FunctionOf(void* module, const char* name) {
  return reinterpret_cast<Function*>(dlsym(module, name));
}

tl::unexpected<Error> NotThere(const ModuleName& name, std::span<const fs::path> folders) {
  std::string looked;
  for (const fs::path& folder : folders) {
    looked += fmt::format("{}{}", looked.empty() ? "" : " and ", folder.string());
  }
  return Fail(
      fmt::format("{} needs the module {}.so, which this trammel came without (looked for in "
                  "{}); install the package {}, or build trammel with that module",
                  name.purpose, name.file, looked, name.package));
}

/// Whether nobody but the program's owner and root can have written the file: a folder above the
/// program's may be open to all, as /tmp is.
bool IsTrusted(const fs::path& path) {
  struct stat module {};
  struct stat program {};
  if (stat(path.c_str(), &module) != 0 || stat("/proc/self/exe", &program) != 0) return false;
  const bool owned = module.st_uid == 0 || module.st_uid == program.st_uid;
  return owned && (module.st_mode & S_IWOTH) == 0;
}

}  // namespace

const ModuleName kVideoModule = {"trammel-video", "reading a video", "trammel-video",
                                 TRAMMEL_VIDEO_PACKAGES};
const ModuleName kScannerModule = {"trammel-scanner", "scanning from a flatbed", "trammel-scanners",
                                   "libsane1"};
const ModuleName kAravisModule = {"trammel-aravis", "a GigE Vision or USB3 Vision camera",
                                  "trammel-machine-vision", "libaravis-0.8-0"};
const ModuleName kPdfModule = {"trammel-pdf", "reading a PDF", "trammel", "libqpdf"};
const ModuleName kWebpModule = {"trammel-webp", "reading a WebP photo", "trammel-photos",
                                "libwebp7"};
const ModuleName kHeifModule = {"trammel-heif", "reading a HEIC photo", "trammel-photos",
                                "libheif1"};
const ModuleName kStepModule = {"trammel-step", "reading STEP", "trammel-step",
                                TRAMMEL_STEP_PACKAGES};

std::vector<fs::path> ModuleFolders() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path folder = program.parent_path();
  return {folder.parent_path() / "lib/trammel", folder.parent_path().parent_path() / "lib/trammel"};
}

Result<const void*> LoadModule(const ModuleName& name, std::span<const fs::path> folders) {
  for (const fs::path& folder : folders) {
    const fs::path path = folder / fmt::format("{}.so", name.file);
    std::error_code error;
    if (!fs::exists(path, error)) continue;
    if (!IsTrusted(path)) {
      return Fail(
          fmt::format("{}: {} is not the program's owner's, or anybody may write to it; "
                      "install trammel anew",
                      name.purpose, path.string()));
    }
    void* const module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (module == nullptr) {
      const char* reason = dlerror();
      return Fail(
          fmt::format("{} needs libraries that cannot be loaded ({}); install them: apt "
                      "install {}",
                      name.purpose, reason != nullptr ? reason : "no reason given", name.packages));
    }
    auto* const version = FunctionOf<const char*()>(module, "trammel_module_version");
    auto* const table = FunctionOf<const void*()>(module, "trammel_module");
    if (version == nullptr || table == nullptr || std::string_view(version()) != TRAMMEL_VERSION) {
      return Fail(
          fmt::format("{}: {} is of another version than this trammel ({}); install both "
                      "anew",
                      name.purpose, path.string(), TRAMMEL_VERSION));
    }
    return table();
  }
  return NotThere(name, folders);
}

}  // namespace trammel::machine
