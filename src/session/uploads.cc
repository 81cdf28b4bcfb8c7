#include "session/uploads.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace trammel::procedure {
namespace {

using nlohmann::json;

/// Checks that a file of this name can be requested; its owner may have to rename it first.
Result<void> CheckFetchable(const std::string& name) {
  std::string shown = name;
  bool plain = true;
  for (char& c : shown) {
    const bool good = static_cast<unsigned char>(c) >= ' ' && c != 0x7F && c != '"' && c != '\\';
    plain = plain && good;
    if (!good) c = '?';
  }
  // Replacement character of a byte that is no UTF-8, as read by machine/moonraker.
  plain = plain && name.find("\uFFFD") == std::string::npos;
  if (plain) return {};
  return Fail(
      fmt::format("{}: a file with a quotation mark, a backslash, a line end or a broken "
                  "character in its name cannot be fetched: rename it",
                  shown));
}

}  // namespace

Result<std::vector<UploadedFile>> ListUploads(
    const Session& session, const std::function<bool(const std::string&)>& wanted) {
  constexpr double kAsk_s = 10;
  const auto listed = TRY(session.printer.CallServer("server.files.list", {{"root", "config"}},
                                                     session.Within(kAsk_s)));
  const std::string folder = fmt::format("{}/", kUploadFolder);
  std::vector<UploadedFile> uploads;
  for (const json& file : listed) {
    if (!file.is_object() || !file.contains("path") || !file["path"].is_string()) continue;
    const auto& path = file["path"].get_ref<const std::string&>();
    if (!path.starts_with(folder)) continue;
    std::string name = path.substr(folder.size());
    if (name.find('/') != std::string::npos || !wanted(name)) continue;
    const auto modified = file.find("modified");
    uploads.push_back({std::move(name), modified != file.end() && modified->is_number()
                                            ? modified->get<double>()
                                            : 0});
  }
  std::ranges::stable_sort(uploads, {}, &UploadedFile::modified_s);
  return uploads;
}

Result<std::string> DownloadUpload(const Session& session, const std::string& name,
                                   std::size_t max_bytes) {
  TRY(CheckFetchable(name));
  constexpr double kDownload_s = 120;
  session.Report("fetching " + name);
  return session.printer.DownloadConfig(fmt::format("{}/{}", kUploadFolder, name), max_bytes,
                                        session.Within(kDownload_s));
}

std::string EndingAmong(std::span<const std::string_view> endings, const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot == 0 || name.find('/') != std::string::npos) return {};
  std::string ending = name.substr(dot);
  for (char& c : ending) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return std::find(endings.begin(), endings.end(), ending) != endings.end() ? ending
                                                                            : std::string();
}

}  // namespace trammel::procedure
