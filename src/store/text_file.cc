#include "store/text_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

namespace trammel::store {

namespace fs = std::filesystem;

Result<std::string> ReadTextFile(const fs::path& path, std::size_t max_bytes) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) {
    return Fail(fmt::format("{}: there is no such file; check the path", path.string()));
  }
  if (fs::is_directory(status)) {
    return Fail(fmt::format("{}: is a folder, not a file", path.string()));
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return Fail(fmt::format("{}: cannot be opened: {}", path.string(), std::strerror(errno)));
  }
  // One byte more than allowed tells a file that is too large, also where it has no size (a pipe).
  std::string text(max_bytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) {
    return Fail(fmt::format("{}: reading failed: {}", path.string(), std::strerror(errno)));
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > max_bytes) {
    return Fail(fmt::format("{}: is larger than {} bytes, which no such file needs", path.string(),
                            max_bytes));
  }
  return text;
}

Result<void> WriteTextFile(const fs::path& path, std::string_view text) {
  fs::path partial = path;
  partial += ".part";
  const auto fail = [&](const std::string& why) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    return Fail(fmt::format("{}: cannot be written: {}", path.string(), why));
  };
  {
    std::ofstream file(partial, std::ios::binary | std::ios::trunc);
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    file.close();
    if (!file) return fail(std::strerror(errno));
  }
  std::error_code code;
  fs::rename(partial, path, code);
  if (code) return fail(code.message());
  return {};
}

}  // namespace trammel::store
