// Modules beside the program, loaded on demand: only the commands that need a rare library load it.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

struct ModuleName {
  std::string_view file;      ///< without extension: "trammel-step"
  std::string_view purpose;   ///< caller's purpose, opens every message: "reading STEP"
  std::string_view package;   ///< trammel's own package that has it: "trammel-step"
  std::string_view packages;  ///< Debian packages of its libraries
};

/// Available modules; each has a header that declares its table.
extern const ModuleName kAravisModule;  ///< camera_sources.h
extern const ModuleName kPdfModule;     ///< page/pdf_module.h
extern const ModuleName kWebpModule;    ///< phone_picture.h
extern const ModuleName kHeifModule;    ///< phone_picture.h
extern const ModuleName kStepModule;    ///< cad/step_module.h

/// Returns lib/trammel beside the running program's folder; in a build tree (with a CMakeCache.txt)
/// also beside that folder's parent.
[[nodiscard]] std::vector<std::filesystem::path> ModuleFolders();

/// Loads a module permanently.
/// @returns the table from its function `trammel_module`, of the type in its header.
/// Errors (kInput), which name the packages: it is in none of the folders; users other than the
/// program's owner and root could have changed it or a folder above it; it was built for another
/// version of trammel; it lacks a library.
[[nodiscard]] Result<const void*> LoadModule(const ModuleName& name,
                                             std::span<const std::filesystem::path> folders);

/// Loads a module from ModuleFolders() and returns its typed table.
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
