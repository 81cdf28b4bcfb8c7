#include "sim/moonraker/multipart.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>

namespace trammel::sim {
namespace {

constexpr std::size_t kMostParts = 100;

// The value of key="value" or key=value in a header.
std::string Attribute(std::string_view header, std::string_view key) {
  std::size_t at = 0;
  while ((at = header.find(key, at)) != std::string_view::npos) {
    const bool begins = at == 0 || header[at - 1] == ' ' || header[at - 1] == ';';
    const std::size_t after = at + key.size();
    at = after;
    if (!begins || after >= header.size() || header[after] != '=') continue;
    std::string_view value = header.substr(after + 1);
    if (!value.empty() && value.front() == '"') {
      value.remove_prefix(1);
      return std::string(value.substr(0, value.find('"')));
    }
    return std::string(value.substr(0, value.find_first_of("; \r\n")));
  }
  return {};
}

}  // namespace

Result<std::vector<FormPart>> ParseMultipart(std::string_view content_type, std::string_view body) {
  const std::string boundary = Attribute(content_type, "boundary");
  if (content_type.substr(0, 19) != "multipart/form-data" || boundary.empty()) {
    return Fail("the upload is no multipart/form-data with a boundary");
  }
  const std::string mark = "--" + boundary;
  std::vector<FormPart> parts;
  std::size_t at = body.find(mark);
  while (at != std::string_view::npos) {
    at += mark.size();
    if (body.substr(at, 2) == "--") return parts;
    const std::size_t head_end = body.find("\r\n\r\n", at);
    const std::size_t next = body.find("\r\n" + mark, at);
    if (head_end == std::string_view::npos || next == std::string_view::npos || head_end > next) {
      break;
    }
    if (parts.size() >= kMostParts) return Fail("the upload has more than 100 parts");
    const std::string_view head = body.substr(at, head_end - at);
    const std::size_t from = std::min(next, head_end + 4);
    parts.push_back({Attribute(head, "name"), Attribute(head, "filename"),
                     std::string(body.substr(from, next - from))});
    at = next + 2;
  }
  return Fail("the upload's form is not closed by its boundary");
}

std::string Sha256(std::string_view data) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  EVP_Digest(data.data(), data.size(), digest.data(), &size, EVP_sha256(), nullptr);
  std::string hex;
  for (unsigned int i = 0; i < size; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

}  // namespace trammel::sim
