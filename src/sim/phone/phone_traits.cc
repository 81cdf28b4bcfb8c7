// Values of a phone: bounds, names, random draw, and truth.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "sim/camera/jpeg.h"
#include "sim/phone/phone_photo.h"

namespace trammel::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFilmDiagonalMm = 43.27;

struct PhoneField {
  const char* name;
  double least;
  double most;
  double unit;  // field's units per unit of the name's number
  double& (*at)(PhoneTraits& traits);
};

constexpr PhoneField kFields[] = {
    {"focal-px", 500, 20000, 1, [](PhoneTraits& t) -> double& { return t.focal_px; }},
    {"distance-mm", 50, 5000, 1, [](PhoneTraits& t) -> double& { return t.distance_mm; }},
    {"turn-deg", -360, 360, kDegree, [](PhoneTraits& t) -> double& { return t.turn_rad; }},
    {"tilt-deg", 0, 45, kDegree, [](PhoneTraits& t) -> double& { return t.tilt_rad; }},
    {"tilt-to-deg", -360, 360, kDegree, [](PhoneTraits& t) -> double& { return t.tilt_to_rad; }},
    {"shift-x-px", -9000, 9000, 1, [](PhoneTraits& t) -> double& { return t.shift_x_px; }},
    {"shift-y-px", -9000, 9000, 1, [](PhoneTraits& t) -> double& { return t.shift_y_px; }},
    {"k1", -0.5, 0.5, 1, [](PhoneTraits& t) -> double& { return t.radial[0]; }},
    {"k2", -0.5, 0.5, 1, [](PhoneTraits& t) -> double& { return t.radial[1]; }},
    {"k3", -0.5, 0.5, 1, [](PhoneTraits& t) -> double& { return t.radial[2]; }},
    {"p1", -0.01, 0.01, 1, [](PhoneTraits& t) -> double& { return t.tangential[0]; }},
    {"p2", -0.01, 0.01, 1, [](PhoneTraits& t) -> double& { return t.tangential[1]; }},
    {"centre-x-px", -200, 200, 1, [](PhoneTraits& t) -> double& { return t.centre_x_px; }},
    {"centre-y-px", -200, 200, 1, [](PhoneTraits& t) -> double& { return t.centre_y_px; }},
    {"bow-mm", -10, 10, 1, [](PhoneTraits& t) -> double& { return t.bow_mm; }},
    {"bow-deg", -360, 360, kDegree, [](PhoneTraits& t) -> double& { return t.bow_rad; }},
    {"wave-mm", 0, 5, 1, [](PhoneTraits& t) -> double& { return t.wave_mm; }},
    {"line-um", 0, 1000, 1e-3, [](PhoneTraits& t) -> double& { return t.line_height_mm; }},
    {"colour-px", -10, 10, 1, [](PhoneTraits& t) -> double& { return t.colour_px; }},
    {"blur-px", 0.29, 20, 1, [](PhoneTraits& t) -> double& { return t.blur_px; }},
    {"sharpen", 0, 3, 1, [](PhoneTraits& t) -> double& { return t.sharpen; }},
    {"noise", 0, 0.2, 1, [](PhoneTraits& t) -> double& { return t.noise; }},
    {"vignetting", 0, 0.9, 1, [](PhoneTraits& t) -> double& { return t.vignetting; }},
    {"gradient", -1, 1, 1, [](PhoneTraits& t) -> double& { return t.gradient; }},
    {"gradient-deg", -360, 360, kDegree, [](PhoneTraits& t) -> double& { return t.gradient_rad; }},
    {"glare", 0, 3, 1, [](PhoneTraits& t) -> double& { return t.glare; }},
    {"glare-x", -1, 1, 1, [](PhoneTraits& t) -> double& { return t.glare_x; }},
    {"glare-y", -1, 1, 1, [](PhoneTraits& t) -> double& { return t.glare_y; }},
    {"glare-size", 0.005, 1, 1, [](PhoneTraits& t) -> double& { return t.glare_size; }},
    {"gamma", 0.5, 3, 1, [](PhoneTraits& t) -> double& { return t.gamma; }},
};

// Whole numbers, and traits of each tool: "line-3-um", "colour-3-px".
enum class Special { kNone, kWidth, kHeight, kQuality, kToolHeight, kToolColour };

Special SpecialOf(std::string_view name, std::size_t& tool) {
  if (name == "width-px") return Special::kWidth;
  if (name == "height-px") return Special::kHeight;
  if (name == "jpeg-quality") return Special::kQuality;
  const auto of_tool = [&](std::string_view before, std::string_view after) {
    if (name.size() != before.size() + 1 + after.size()) return false;
    if (!name.starts_with(before) || !name.ends_with(after)) return false;
    const int digit = name[before.size()] - '0';
    if (digit < 0 || digit >= kMaxSheetTools) return false;
    tool = static_cast<std::size_t>(digit);
    return true;
  };
  if (of_tool("line-", "-um")) return Special::kToolHeight;
  if (of_tool("colour-", "-px")) return Special::kToolColour;
  return Special::kNone;
}

Result<void> Bounded(std::string_view name, double value, double least, double most) {
  if (value >= least && value <= most) return {};
  return Fail(fmt::format("{} = {}: must be {} ... {}", name, value, least, most));
}

}  // namespace

PhoneTraits DrawPhone(const PrintedSheet& sheet, Random random) {
  PhoneTraits traits;
  const TurnedPrint print = Turned(sheet, 0);
  const bool upright = print.half_height_mm > print.half_width_mm;
  const double width_mm = 2 * std::max(print.half_width_mm, print.half_height_mm);
  const double height_mm = 2 * std::min(print.half_width_mm, print.half_height_mm);
  traits.focal_px = random.Uniform(5400, 5800);
  const double fills = random.Uniform(0.72, 0.8);
  const double px_per_mm =
      fills * std::min(traits.width_px / width_mm, traits.height_px / height_mm);
  traits.distance_mm = traits.focal_px / px_per_mm;
  traits.turn_rad = (upright ? 90 * kDegree : 0) + random.Uniform(-4, 4) * kDegree;
  if (random.Uniform() < 0.5) traits.turn_rad += std::numbers::pi;
  traits.tilt_rad = random.Uniform(0, 15) * kDegree;
  traits.tilt_to_rad = random.Uniform(-180, 180) * kDegree;
  traits.radial = {random.Uniform(-0.03, 0.03), random.Uniform(-0.02, 0.02),
                   random.Uniform(-0.02, 0.02)};
  traits.tangential = {random.Uniform(-5e-4, 5e-4), random.Uniform(-5e-4, 5e-4)};
  traits.centre_x_px = random.Uniform(-20, 20);
  traits.centre_y_px = random.Uniform(-20, 20);
  traits.bow_mm = random.Uniform(-1, 1);
  traits.bow_rad = random.Uniform(-180, 180) * kDegree;
  traits.wave_mm = random.Uniform(0, 0.1);
  traits.line_height_mm = 0.2;
  for (double& extra : traits.extra_height_mm) {
    extra = std::clamp(random.Normal(0, 0.03), -0.1, 0.1);
  }
  traits.colour_px = random.Uniform(-0.3, 0.3);
  for (double& shift : traits.tool_colour_px) shift = random.Normal(0, 0.2);
  traits.blur_px = random.Uniform(0.6, 1);
  traits.sharpen = random.Uniform(0, 0.8);
  traits.noise = random.Uniform(0.003, 0.012);
  traits.vignetting = random.Uniform(0, 0.3);
  traits.gradient = random.Uniform(0, 0.4);
  traits.gradient_rad = random.Uniform(-180, 180) * kDegree;
  traits.jpeg_quality = 90 + static_cast<int>(random.Below(6));
  return traits;
}

std::string PhoneTraitNames() {
  std::string names;
  for (const PhoneField& field : kFields) names += std::string(field.name) + ", ";
  return names + "width-px, height-px, jpeg-quality, line-TOOL-um, colour-TOOL-px";
}

Result<void> SetPhoneTrait(std::string_view name, double value, PhoneTraits& traits) {
  for (const PhoneField& field : kFields) {
    if (name != field.name) continue;
    TRY(Bounded(name, value, field.least, field.most));
    field.at(traits) = value * field.unit;
    return {};
  }
  std::size_t tool = 0;
  const auto whole = static_cast<int>(std::lround(std::clamp(value, -1e6, 1e6)));
  switch (SpecialOf(name, tool)) {
    case Special::kWidth:
      traits.width_px = whole;
      return Bounded(name, value, 64, 9000);
    case Special::kHeight:
      traits.height_px = whole;
      return Bounded(name, value, 64, 9000);
    case Special::kQuality:
      traits.jpeg_quality = whole;
      return Bounded(name, value, 1, 100);
    case Special::kToolHeight:
      traits.extra_height_mm[tool] = value * 1e-3;
      return Bounded(name, value, -500, 500);
    case Special::kToolColour:
      traits.tool_colour_px[tool] = value;
      return Bounded(name, value, -10, 10);
    case Special::kNone:
      break;
  }
  return Fail(fmt::format("{}: there is no such name; choose one of {}", name.substr(0, 40),
                          PhoneTraitNames()));
}

std::string PhoneTruthJson(const SheetName& name, const PrintedSheet& sheet, int reference,
                           const PhoneTraits& traits) {
  using Json = nlohmann::ordered_json;
  Json tools = Json::array();
  for (const SheetToolTruth& truth : sheet.tools) {
    const auto tool = static_cast<std::size_t>(truth.tool);
    Json entry = {{"tool", truth.tool},
                  {"line_height_mm", traits.line_height_mm + traits.extra_height_mm[tool]},
                  {"colour_px", traits.tool_colour_px[tool]},
                  {"printed", truth.printed}};
    if (truth.tool != reference) {
      const auto offset = OffsetOf(sheet, truth.tool, reference);
      entry["dx_mm"] = offset ? Json(offset->x_mm) : Json();
      entry["dy_mm"] = offset ? Json(offset->y_mm) : Json();
    }
    tools.push_back(entry);
  }
  Json photo;
  PhoneTraits copy = traits;
  for (const PhoneField& field : kFields) photo[field.name] = field.at(copy) / field.unit;
  const Json json = {{"format", 1},
                     {"seed", name.seed},
                     {"sheet", name.sheet},
                     {"photo", name.scan},
                     {"reference", reference},
                     {"tools", tools},
                     {"backlash_mm", {{"x", sheet.backlash_mm[0]}, {"y", sheet.backlash_mm[1]}}},
                     {"width_px", traits.width_px},
                     {"height_px", traits.height_px},
                     {"camera", photo}};
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string PhoneJpeg(const Frame& frame, const PhoneTraits& traits) {
  std::vector<std::uint8_t> jpeg;
  EncodeJpeg(frame.view(), traits.jpeg_quality, jpeg);
  const double film_mm =
      traits.focal_px * kFilmDiagonalMm / std::hypot(traits.width_px, traits.height_px);
  const auto focal = static_cast<int>(std::lround(std::clamp(film_mm, 1.0, 60000.0)));
  std::string exif;
  const auto put = [&](unsigned value, int bytes) {
    for (int i = 0; i < bytes; ++i) exif.push_back(static_cast<char>(value >> (8 * i) & 0xff));
  };
  exif.append("Exif", 4).append(2, '\0').append("II*", 3).append(1, '\0');
  put(8, 4);                                         // the first directory's place
  put(1, 2);                                         // one entry:
  put(0x8769, 2), put(4, 2), put(1, 4), put(26, 4);  // the place of the camera's own directory
  put(0, 4);
  put(1, 2);  // with one entry, FocalLengthIn35mmFilm
  put(0xa405, 2), put(3, 2), put(1, 4), put(static_cast<unsigned>(focal), 4);
  put(0, 4);
  const std::size_t length = exif.size() + 2;
  std::string file(reinterpret_cast<const char*>(jpeg.data()), 2);
  file.append("\xff\xe1", 2);
  file.push_back(static_cast<char>(length >> 8));
  file.push_back(static_cast<char>(length & 0xff));
  file.append(exif);
  file.append(reinterpret_cast<const char*>(jpeg.data()) + 2, jpeg.size() - 2);
  return file;
}

}  // namespace trammel::sim
