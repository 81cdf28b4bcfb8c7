#include "pressure_advance/photo/photo_search.h"

#include <algorithm>
#include <utility>

#include "vision/filament_contrast.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

PhotoSearch::PhotoSearch(Frame photo)
    : photo_width_px_(photo.width), photo_height_px_(photo.height), picture_(std::move(photo)) {
  const double px = static_cast<double>(photo_width_px_) * photo_height_px_;
  if (std::max(photo_width_px_, photo_height_px_) <= kLongestMeasured_px && px <= kMaxMeasured_px) {
    return;
  }
  double scale = 1;
  picture_ = vision::ShrinkToFit(picture_.view(), kLongestMeasured_px, kMaxMeasured_px, scale);
}

const std::vector<vision::FoundComb>& PhotoSearch::Combs() {
  if (!combs_) combs_ = vision::FindCombs(picture_.view());
  return *combs_;
}

PhotoSearch& PhotoSearch::InColours() {
  if (!grey_) {
    grey_ = vision::IsGrey(picture_.view());
    if (*grey_) {
      textured_ = std::make_unique<PhotoSearch>(vision::WithTexture(picture_.view()));
    }
  }
  return textured_ ? *textured_ : *this;
}

}  // namespace trammel::pressure_advance
