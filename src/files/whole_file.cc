#include "files/whole_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

namespace trammel::files {

namespace fs = std::filesystem;

Result<std::string> ReadWholeFile(const fs::path& path, std::size_t max_bytes) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) {
    if (fs::is_symlink(fs::symlink_status(path, code))) {
      return Fail(fmt::format("{}: is a link to {}, which is not there", path.string(),
                              fs::read_symlink(path, code).string()));
    }
    return Fail(fmt::format("{}: there is no such file; check the path", path.string()));
  }
  if (fs::is_directory(status)) {
    return Fail(fmt::format("{}: is a folder, not a file", path.string()));
  }
  const auto too_large = [&] {
    return Fail(fmt::format("{}: is larger than {} bytes, which no such file needs", path.string(),
                            max_bytes));
  };
  const std::uintmax_t size = fs::is_regular_file(status) ? fs::file_size(path, code) : 0;
  if (!code && size > max_bytes) return too_large();
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return Fail(fmt::format("{}: cannot be opened: {}", path.string(), std::strerror(errno)));
  }
  // One byte more than the limit detects a file without size (a pipe), or one that grows.
  constexpr std::size_t kPiece = std::size_t{1} << 16;
  std::string text;
  while (file && text.size() <= max_bytes) {
    const std::size_t had = text.size();
    text.resize(had + std::min(kPiece, max_bytes + 1 - had));
    file.read(text.data() + had, static_cast<std::streamsize>(text.size() - had));
    text.resize(had + static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) {
    return Fail(fmt::format("{}: reading failed: {}", path.string(), std::strerror(errno)));
  }
  if (text.size() > max_bytes) return too_large();
  return text;
}

Result<std::string> ReadNamedFile(const fs::path& path, std::size_t max_bytes) {
  std::error_code missing;
  const fs::file_status status = fs::status(path, missing);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return Fail(fmt::format("{}: is not a regular file; put a copy in its place", path.string()));
  }
  return ReadWholeFile(path, max_bytes);
}

}  // namespace trammel::files
