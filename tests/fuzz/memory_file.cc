#include "memory_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>

#include "fuzz.h"

namespace trammel::fuzz {
namespace {

std::filesystem::path NewFolder() {
  std::error_code none;
  const std::filesystem::path memory = "/dev/shm";
  const bool there = std::filesystem::is_directory(memory, none);
  std::string name =
      ((there ? memory : std::filesystem::temp_directory_path()) / "trammel-fuzz-XXXXXX").string();
  Require(mkdtemp(name.data()) != nullptr, "there is a folder for temporary files");
  return name;
}

}  // namespace

MemoryFile::MemoryFile(const std::string& name) : folder_(NewFolder()), path_(folder_ / name) {}

MemoryFile::~MemoryFile() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

void MemoryFile::Write(std::string_view bytes) const {
  constexpr mode_t kRights = 0600;
  const int file = open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kRights);
  Require(file >= 0, "the temporary file can be opened");
  while (!bytes.empty()) {
    const ssize_t written = write(file, bytes.data(), bytes.size());
    Require(written > 0, "the temporary file can be written");
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  close(file);
}

}  // namespace trammel::fuzz
