#include "photo_world.h"

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>

#include "image/jpeg_reader.h"

namespace trammel {

sim::PhoneTraits TakenAgain(const sim::PrintedSheet& sheet, const sim::PhoneTraits& phone,
                            Random random) {
  const sim::PhoneTraits other = sim::DrawPhone(sheet, random);
  sim::PhoneTraits again = phone;
  // Same size in the picture as the other one.
  again.distance_mm =
      other.distance_mm / other.focal_px * other.width_px * phone.focal_px / phone.width_px;
  again.turn_rad = phone.turn_rad + (phone.turn_rad > 0 ? -1 : 1) * std::numbers::pi;
  again.tilt_rad = other.tilt_rad;
  again.tilt_to_rad = other.tilt_to_rad;
  again.blur_px = other.blur_px;
  again.noise = other.noise;
  again.gradient = other.gradient;
  again.gradient_rad = other.gradient_rad;
  again.jpeg_quality = other.jpeg_quality;
  return again;
}

Result<tool_offset::SheetResult> SeePhoto(const PatternFile& pattern,
                                          const sim::PrintedSheet& sheet,
                                          const sim::PhoneTraits& phone, const sim::SheetName& name,
                                          std::uint64_t photo) {
  const auto frame = sim::PhotographSheet(sheet, phone, sim::ScanningOf(name).Fork(1 + photo));
  if (!frame) throw std::runtime_error(frame.error().message);
  const std::string file = sim::PhoneJpeg(*frame, phone);
  auto jpeg = image::JpegReader::Open(
      std::span(reinterpret_cast<const std::uint8_t*>(file.data()), file.size()),
      image::JpegDamage::kRefuse);
  if (!jpeg) throw std::runtime_error(jpeg.error().message);
  if (!jpeg->Start(image::JpegPixels::kBgr)) throw std::runtime_error("a JPEG that does not start");
  std::vector<std::uint8_t> pixels(std::size_t{3} * static_cast<std::size_t>(frame->width) *
                                   static_cast<std::size_t>(frame->height));
  const std::ptrdiff_t stride = std::ptrdiff_t{3} * frame->width;
  for (int y = 0; y < frame->height; ++y) {
    if (!jpeg->ReadRow(pixels.data() + y * stride)) throw std::runtime_error("a JPEG cut off");
  }
  tool_offset::AnalyseOptions options;
  options.kind = tool_offset::PageKind::kPhoto;
  if (const auto focal_mm = jpeg->header().film_focal_mm) options.photo.film_focal_mm = *focal_mm;
  return tool_offset::AnalyseSheet({pixels.data(), frame->width, frame->height, 3, stride},
                                   pattern.plan, options);
}

}  // namespace trammel
