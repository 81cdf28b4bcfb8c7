#include "report/write_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

namespace trammel::report {

Result<void> WriteFile(const std::filesystem::path& path, std::string_view bytes) {
  std::filesystem::path part = path;
  part += ".part";
  const auto fail = [&](const std::string& answer) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    return Fail(
        fmt::format("cannot write {} ({} bytes): {}; check the folder, its rights and the "
                    "free space",
                    path.string(), bytes.size(), answer));
  };
  {
    errno = 0;
    std::ofstream file(part, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) {
      return fail(errno != 0 ? std::strerror(errno) : "the stream failed");
    }
  }
  std::error_code error;
  std::filesystem::rename(part, path, error);
  if (error) {
    return fail(error.message());
  }
  return {};
}

}  // namespace trammel::report
