#include "part_alignment/files/part_fit_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <tuple>
#include <utility>

#include "base/utf8.h"
#include "files/json_object.h"
#include "files/whole_file.h"
#include "part_alignment/files/target_file.h"

namespace trammel::files {
namespace {

using part_alignment::IdealSurface;
using part_alignment::MeasuredPoint;
using part_alignment::SurfaceKind;

constexpr double kMax_mm = 1e6;
constexpr std::size_t kMaxPoints = 100'000;
constexpr std::size_t kMaxBytes = 50'000'000;

// Reads an id, which may be written as a number.
std::string Id(JsonObject& object, const char* key) {
  const nlohmann::json* value = object.Find(key);
  if (value != nullptr && value->is_number_integer())
    return value->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return object.Text(key);
}

// Meshes that a part names: each is read once, for any number of surfaces.
struct NamedMeshes {
  const MeshReader& reader;
  std::filesystem::path folder;
  std::map<std::tuple<std::string, std::string, bool>, MeshFile> read;
};

Result<void> ReadMesh(JsonObject& object, NamedMeshes& meshes, IdealSurface& surface,
                      PartFile& part) {
  surface.kind = SurfaceKind::kMesh;
  const std::string file = object.Text("file");
  const auto unit = object.OptionalChoice("unit", {"mm", "cm", "m", "inch"});
  const nlohmann::json* open = object.Find("open");
  if (open != nullptr && !open->is_boolean()) object.Fault("open", "must be true or false");
  surface.max_facet_error_mm = object.OptionalNumber("most_facet_error_mm", {1e-9, kMax_mm});
  surface.stock_allowance_mm = object.Number("overstock_mm", {-kMax_mm, kMax_mm});
  TRY(object.Finish());
  const bool may_be_open = open != nullptr && open->get<bool>();
  const std::tuple key(file, unit.value_or(""), may_be_open);
  auto found = meshes.read.find(key);
  if (found == meshes.read.end()) {
    constexpr std::size_t kMaxMeshes = 8;  // up to 250 MB each
    if (meshes.read.size() == kMaxMeshes) {
      object.Fault("file", fmt::format("is one more than the {} meshes that are read", kMaxMeshes));
      return object.Faults();
    }
    auto mesh = TRY(meshes.reader(meshes.folder / file, unit ? LengthUnitOf(*unit) : std::nullopt,
                                  may_be_open));
    part.notices.insert(part.notices.end(), mesh.notices.begin(), mesh.notices.end());
    found = meshes.read.emplace(key, std::move(mesh)).first;
  }
  surface.mesh = found->second.mesh;
  return {};
}

Result<void> ReadSurfaces(JsonObject& root, NamedMeshes meshes, PartFile& part) {
  for (const nlohmann::json& entry : root.List("surfaces", 1, 10'000)) {
    JsonObject object = root.Inner(entry, fmt::format("surfaces[{}]", part.surfaces.size()));
    IdealSurface surface;
    surface.id = Id(object, "id");
    const std::string kind = object.Choice("kind", {"plane", "shaft", "bore", "mesh"});
    if (kind == "mesh") {
      TRY(ReadMesh(object, meshes, surface, part));
      part.surfaces.push_back(std::move(surface));
      continue;
    }
    surface.kind = kind == "shaft"  ? SurfaceKind::kShaft
                   : kind == "bore" ? SurfaceKind::kBore
                                    : SurfaceKind::kPlane;
    surface.middle_mm = ReadThree(object, "middle_mm", {-kMax_mm, kMax_mm});
    surface.direction = ReadThree(object, "direction", {-kMax_mm, kMax_mm});
    if (surface.kind != SurfaceKind::kPlane)
      surface.radius_mm = object.Number("radius_mm", {0, kMax_mm});
    surface.stock_allowance_mm = object.Number("overstock_mm", {-kMax_mm, kMax_mm});
    TRY(object.Finish());
    part.surfaces.push_back(std::move(surface));
  }
  return root.Faults();
}

std::vector<std::string_view> Cells(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t end = std::min(line.find(separator), line.size());
    std::string_view cell = line.substr(0, end);
    while (!cell.empty() && (cell.front() == ' ' || cell.front() == '"')) cell.remove_prefix(1);
    while (!cell.empty() && (cell.back() == ' ' || cell.back() == '"' || cell.back() == '\r')) {
      cell.remove_suffix(1);
    }
    cells.push_back(cell);
    if (end == line.size()) return cells;
    line.remove_prefix(end + 1);
  }
}

constexpr std::array<std::string_view, 6> kColumns = {"id",   "x_mm",     "y_mm",
                                                      "z_mm", "sigma_mm", "surface"};

struct Header {
  char separator = ',';
  std::array<std::size_t, kColumns.size()> at{};
  std::size_t cells = 0;
};

Result<Header> ReadHeader(std::string_view line, const std::string& where) {
  Header header;
  if (line.find(';') != std::string_view::npos) header.separator = ';';
  if (line.find('\t') != std::string_view::npos) header.separator = '\t';
  const auto cells = Cells(line, header.separator);
  header.cells = cells.size();
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    const auto found = std::find(cells.begin(), cells.end(), kColumns[i]);
    if (found == cells.end()) {
      return Fail(fmt::format("{}: the column {} is missing; the first line must name {}", where,
                              kColumns[i], fmt::join(kColumns, ", ")));
    }
    header.at[i] = static_cast<std::size_t>(found - cells.begin());
  }
  return header;
}

Result<MeasuredPoint> ReadRow(std::string_view line, const Header& header,
                              const std::string& where) {
  const auto cells = Cells(line, header.separator);
  if (cells.size() != header.cells) {
    return Fail(
        fmt::format("{}: {} cells, the first line has {}", where, cells.size(), header.cells));
  }
  std::array<double, 4> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::string_view cell = cells[header.at[i + 1]];
    const auto read = std::from_chars(cell.data(), cell.data() + cell.size(), numbers[i]);
    if (read.ec != std::errc{} || read.ptr != cell.data() + cell.size() || cell.empty()) {
      return Fail(fmt::format("{}: {} is \"{}\"; it must be a number (with a point)", where,
                              kColumns[i + 1], cell.substr(0, 40)));
    }
  }
  MeasuredPoint point;
  point.id = std::string(cells[header.at[0]]);
  point.at_mm = {numbers[0], numbers[1], numbers[2]};
  point.sigma_mm = numbers[3];
  point.surface = std::string(cells[header.at[5]]);
  if (point.id.empty()) return Fail(fmt::format("{}: the id is empty", where));
  return point;
}

Result<std::vector<MeasuredPoint>> PointsFromJson(std::string_view text, const std::string& file) {
  const auto json = TRY(ParseJson(text, file));
  JsonObject root(json, file);
  root.Integer("format", {1, 1});
  std::vector<MeasuredPoint> points;
  for (const nlohmann::json& entry : root.List("points", 1, kMaxPoints)) {
    JsonObject object = root.Inner(entry, fmt::format("points[{}]", points.size()));
    MeasuredPoint point;
    point.id = Id(object, "id");
    point.at_mm = ReadThree(object, "at_mm", {-kMax_mm, kMax_mm});
    point.sigma_mm = object.Number("sigma_mm", {1e-9, kMax_mm});
    if (object.has("surface")) point.surface = Id(object, "surface");
    TRY(object.Finish());
    points.push_back(std::move(point));
  }
  TRY(root.Finish());
  return points;
}

// Reads a list entry that is itself a list of `count` numbers.
std::vector<double> Row(JsonObject& root, const nlohmann::json& entry, const std::string& at,
                        std::size_t count) {
  std::vector<double> numbers;
  bool sound = entry.is_array() && entry.size() == count;
  for (std::size_t i = 0; sound && i < count; ++i) {
    sound = entry[i].is_number();
    if (sound) numbers.push_back(entry[i].get<double>());
  }
  if (sound) return numbers;
  root.Fault(at, fmt::format("is {}; it must be {} numbers", Show(entry), count));
  return std::vector<double>(count, 0);
}

void ReadLists(JsonObject& root, BudgetFile& file) {
  for (const nlohmann::json& entry : root.List("targets_mm", 3, 10'000)) {
    const auto at = fmt::format("targets_mm[{}]", file.scene.targets_mm.size());
    const auto mm = Row(root, entry, at, 3);
    file.scene.targets_mm.emplace_back(mm[0], mm[1], mm[2]);
  }
  if (const nlohmann::json* lengths = root.OptionalList("lengths_mm", 0, 10'000)) {
    for (const nlohmann::json& entry : *lengths) {
      const auto mm = Row(root, entry, fmt::format("lengths_mm[{}]", file.lengths.size()), 2);
      file.lengths.push_back({mm[0], mm[1]});
    }
  }
}

}  // namespace

Result<std::vector<part_alignment::ScaleBar>> ReadScaleBars(JsonObject& root) {
  std::vector<part_alignment::ScaleBar> read_bars;
  const nlohmann::json* bars = root.OptionalList("scale_bars", 0, 1000);
  for (const nlohmann::json& entry : bars != nullptr ? *bars : nlohmann::json::array()) {
    JsonObject object = root.Inner(entry, fmt::format("scale_bars[{}]", read_bars.size()));
    part_alignment::ScaleBar bar;
    bar.from = Id(object, "from");
    bar.to = Id(object, "to");
    bar.length_mm = object.Number("length_mm", {0, kMax_mm});
    bar.sigma_mm = object.Number("sigma_mm", {0, kMax_mm});
    TRY(object.Finish());
    read_bars.push_back(std::move(bar));
  }
  TRY(root.Faults());
  return read_bars;
}

Result<PartFile> ReadPartFile(const std::filesystem::path& path, const MeshReader& read_mesh) {
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  PartFile part;
  part.options.min_stock_allowance_mm = root.Number("least_overstock_mm", {-1000, 1000}, 0.0);
  part.options.guard_sigmas = root.Number("guard_sigmas", {0, 10}, 2.0);
  part.options.max_uneven_mm = root.OptionalNumber("most_uneven_mm", {1e-9, kMax_mm});
  TRY(ReadSurfaces(root, {read_mesh, path.parent_path(), {}}, part));
  part.bars = TRY(ReadScaleBars(root));
  if (const nlohmann::json* start = root.Find("start")) {
    JsonObject object = root.Inner(*start, "start");
    geometry::Pose pose;
    pose.translation_mm = ReadThree(object, "translation_mm", {-kMax_mm, kMax_mm});
    constexpr double kTurn = 2 * std::numbers::pi;
    pose.angles_rad = ReadThree(object, "angles_rad", {-kTurn, kTurn});
    TRY(object.Finish());
    part.start = pose;
  }
  TRY(root.Finish());
  return part;
}

Result<std::vector<MeasuredPoint>> ParsePointTable(std::string_view text, const std::string& file) {
  if (text.starts_with("PK\x03\x04")) {
    return Fail(
        fmt::format("{}: is a ZIP, as spreadsheets' .xlsx and .ods are: save it as CSV "
                    "(comma or semicolon, UTF-8)",
                    file));
  }
  if (text.find('\0') != std::string_view::npos) {
    return Fail(
        fmt::format("{}: is no text, or UTF-16 without its mark: save it as CSV (UTF-8)", file));
  }
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return Fail(fmt::format("{}: is empty", file));
  if (text[first] == '{') return PointsFromJson(text, file);
  std::vector<MeasuredPoint> points;
  std::optional<Header> header;
  std::size_t number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    const std::string where = fmt::format("{}:{}", file, ++number);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos || line.front() == '#') continue;
    if (!header) {
      header = TRY(ReadHeader(line, where));
      continue;
    }
    points.push_back(TRY(ReadRow(line, *header, where)));
    if (points.size() > kMaxPoints) {
      return Fail(fmt::format("{}: more than {} points", file, kMaxPoints));
    }
  }
  return points;
}

Result<std::vector<MeasuredPoint>> ReadPointTable(const std::filesystem::path& path) {
  auto text = TRY(ReadWholeFile(path, kMaxBytes));
  return ParsePointTable(Utf8OfFile(std::move(text)), path.string());
}

Result<BudgetFile> ReadBudgetFile(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = 10'000'000;
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  BudgetFile file;
  part_alignment::BudgetScene& scene = file.scene;
  ReadLists(root, file);
  scene.target_sigma_mm = ReadThree(root, "target_sigma_mm", {0, kMax_mm});
  if (root.has("pose_sigma_mm"))
    scene.pose_sigma.head<3>() = ReadThree(root, "pose_sigma_mm", {0, 1e3});
  if (root.has("pose_sigma_rad"))
    scene.pose_sigma.tail<3>() = ReadThree(root, "pose_sigma_rad", {0, 1});
  if (root.has("repeats")) scene.repeats = root.Integer("repeats", {0, 1'000'000});
  scene.low_mm = ReadThree(root, "box_low_mm", {-kMax_mm, kMax_mm});
  scene.high_mm = ReadThree(root, "box_high_mm", {-kMax_mm, kMax_mm});
  scene.still_mm = scene.low_mm;
  if (root.has("still_mm")) scene.still_mm = ReadThree(root, "still_mm", {-kMax_mm, kMax_mm});
  scene.temperature_half_width_k = root.Number("temperature_half_width_k", {0, 1000}, 1.0);
  scene.expansion_per_k = root.Number("expansion_per_k", {-1e-3, 1e-3}, 11e-6);
  scene.length_error_mm = root.Number("length_error_mm", {0, 1000}, 0.05);
  scene.length_error_per_mm = root.Number("length_error_per_mm", {0, 1}, 20e-6);
  if (root.has("out_sigma_mm")) scene.out_sigma_mm = ReadThree(root, "out_sigma_mm", {0, kMax_mm});
  if (root.has("tolerance_mm")) {
    const auto limits = root.Numbers("tolerance_mm", 2, 2, {-kMax_mm, kMax_mm});
    if (!root.failed() && !(limits[0] < limits[1])) {
      root.Fault("tolerance_mm",
                 fmt::format("is [{}, {}]; it must be the lower and the upper limit", limits[0],
                             limits[1]));
    }
    if (!root.failed()) file.tolerance_mm = {limits[0], limits[1]};
  }
  TRY(root.Finish());
  return file;
}

}  // namespace trammel::files
