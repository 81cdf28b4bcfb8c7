#include "machine/module.h"

#include <dlfcn.h>
#include <fmt/format.h>

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
                  "{}); install all of trammel, or build it with that module",
                  name.purpose, name.file, looked));
}

}  // namespace

const ModuleName kVideoModule = {"trammel-video", "reading a video", TRAMMEL_VIDEO_PACKAGES};
const ModuleName kScannerModule = {"trammel-scanner", "scanning from a flatbed", "libsane1"};
const ModuleName kAravisModule = {"trammel-aravis", "a GigE Vision or USB3 Vision camera",
                                  "libaravis-0.8-0"};

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
