#include "pressure_advance/files/setup_pictures.h"

#include <nlohmann/json.hpp>

#include "base/json_text.h"

namespace trammel::files {
namespace {

using Json = nlohmann::ordered_json;

Json Stripe(const pressure_advance::StripeReading& stripe) {
  Json json = {{"fault", stripe.fault}};
  if (!stripe.fault.empty()) return json;
  json["down"] = stripe.down;
  json["across_px"] = stripe.across_px;
  json["across_sigma_px"] = stripe.across_sigma_px;
  json["slope"] = stripe.slope;
  json["width_px"] = stripe.width_px;
  json["width_sigma_px"] = stripe.width_sigma_px;
  json["peak"] = stripe.peak;
  json["saturated_px"] = stripe.saturated_px;
  return json;
}

Json Mark(const pressure_advance::MarkReading& mark) {
  Json json = {{"fault", mark.fault}};
  if (!mark.fault.empty()) return json;
  json["column_px"] = mark.column_px;
  json["row_px"] = mark.row_px;
  json["sigma_px"] = mark.sigma_px;
  json["side_px"] = mark.side_px;
  json["darker"] = mark.darker;
  json["contrast"] = mark.contrast;
  return json;
}

}  // namespace

std::string FormatSetupPictures(const std::vector<pressure_advance::SetupPicture>& pictures) {
  Json list = Json::array();
  for (const auto& picture : pictures) {
    Json json = {{"file", picture.file},          {"kind", picture.kind},
                 {"x_mm", picture.head.x_mm},     {"y_mm", picture.head.y_mm},
                 {"z_mm", picture.head.z_mm},     {"from_x", picture.head.from_x},
                 {"from_y", picture.head.from_y}, {"from_z", picture.head.from_z}};
    if (picture.stripe) json["stripe"] = Stripe(*picture.stripe);
    if (picture.mark) json["mark"] = Mark(*picture.mark);
    list.push_back(std::move(json));
  }
  return JsonText({{"format", 1}, {"pictures", std::move(list)}});
}

}  // namespace trammel::files
