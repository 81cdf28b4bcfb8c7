#include "measurement/remark.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <system_error>

#include "base/bounded_json.h"
#include "base/json_text.h"
#include "base/utf8.h"
#include "files/new_file.h"
#include "files/whole_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMaxBytes = 8 << 10;

}  // namespace

Remark ReadRemark(const fs::path& folder) {
  const auto text = ReadNamedFile(folder / kRemarkFile, kMaxBytes);
  if (!text) return {};
  const auto object = ParseBoundedJson(*text, kRemarkFile);
  if (!object || !object->is_object()) return {};
  Remark remark;
  if (const auto note = object->find("note"); note != object->end() && note->is_string()) {
    remark.note = note->get<std::string>().substr(0, kMaxNoteBytes);
  }
  if (const auto pinned = object->find("pinned"); pinned != object->end()) {
    remark.pinned = *pinned == true;
  }
  return remark;
}

Result<void> WriteRemark(const fs::path& folder, const Remark& remark) {
  if (remark.note.size() > kMaxNoteBytes) {
    return Fail(
        fmt::format("a note has at most {} bytes, this one {}", kMaxNoteBytes, remark.note.size()));
  }
  if (Utf8OrReplaced(remark.note) != remark.note) return Fail("the note is not UTF-8");
  if (remark == Remark{}) {
    std::error_code error;
    fs::remove(folder / kRemarkFile, error);
    if (!error) return {};
    return Fail(fmt::format("{}: {}", (folder / kRemarkFile).string(), error.message()));
  }
  return WriteWholeFile(
      folder / kRemarkFile,
      JsonText(json{{"format", 1}, {"note", remark.note}, {"pinned", remark.pinned}}),
      IfThere::kReplace);
}

}  // namespace trammel::files
