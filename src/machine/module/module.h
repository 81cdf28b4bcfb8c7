// Modules beside the program, loaded on demand: libraries that few need are mapped by those alone.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

struct ModuleName {
  std::string_view file;      ///< without its ending: "trammel-step"
  std::string_view purpose;   ///< of whoever asks, which begins every message: "reading STEP"
  std::string_view package;   ///< of trammel's own, in which it comes: "trammel-step"
  std::string_view packages;  ///< of Debian, in which its libraries come
};

/// Those that there are; each has a header of its own that states its table.
extern const ModuleName kAravisModule;  ///< camera_sources.h
extern const ModuleName kPdfModule;     ///< page/pdf_module.h
extern const ModuleName kWebpModule;    ///< phone_picture.h
extern const ModuleName kHeifModule;    ///< phone_picture.h
extern const ModuleName kStepModule;    ///< cad/step_module.h

/// lib/trammel beside the folder of the program that runs; in a build tree, which a CMakeCache.txt
/// shows, beside that folder's parent, too.
[[nodiscard]] std::vector<std::filesystem::path> ModuleFolders();

/// Loads a module, which then stays.
/// @returns the table that its function `trammel_module` gives, of the type that its header states.
/// Errors (kInput): it is in none of the folders, others than the program's owner and root could
/// have written it or changed a folder above it, it was made for another version of trammel, or
/// lacks a library; they name the packages.
[[nodiscard]] Result<const void*> LoadModule(const ModuleName& name,
                                             std::span<const std::filesystem::path> folders);

/// The same in ModuleFolders(), as the table's type.
template <class Table>
[[nodiscard]] Result<const Table*> LoadModule(const ModuleName& name) {
  const auto table = TRY(LoadModule(name, ModuleFolders()));
  return static_cast<const Table*>(table);
}

}  // namespace trammel::machine

/// Exports a module's table.
#define TRAMMEL_MODULE(table)                                                              \
  extern "C" __attribute__((visibility("default"))) const char* trammel_module_version() { \
    return TRAMMEL_VERSION;                                                                \
  }                                                                                        \
  extern "C" __attribute__((visibility("default"))) const void* trammel_module() {         \
    return &(table);                                                                       \
  }
