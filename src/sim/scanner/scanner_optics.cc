#include "sim/scanner/scanner_optics.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace trammel::sim {
namespace {

constexpr double kMmPerInch = 25.4;
constexpr std::array<double, 3> kGreyWeights = {0.299, 0.587, 0.114};
constexpr int kGrainTile = 512;
constexpr std::size_t kNoiseLength = std::size_t{1} << 16;
constexpr float kSteps = 65535;

// What one channel sees of a colour; a grey scanner mixes the three.
float Seen(const LinearRgb& colour, const ScannerTraits& traits, int channel) {
  if (traits.colour) {
    const auto index = static_cast<std::size_t>(channel);
    return static_cast<float>(colour[index] * traits.cast[index]);
  }
  double grey = 0;
  for (std::size_t i = 0; i < 3; ++i) grey += kGreyWeights[i] * colour[i] * traits.cast[i];
  return static_cast<float>(grey);
}

// Shares of the rows that shade: light is lost evenly over `length_px` before a row.
std::vector<float> ShadowTaps(double length_px) {
  std::vector<float> taps;
  if (length_px <= 0) return taps;
  for (int i = 0; i - 0.5 < length_px; ++i) {
    const double share = std::min(i + 0.5, length_px) - std::max(i - 0.5, 0.0);
    taps.push_back(static_cast<float>(share / length_px));
  }
  return taps;
}

void AddScaled(const float* from, float factor, std::size_t count, float* to) {
  for (std::size_t i = 0; i < count; ++i) to[i] += factor * from[i];
}

}  // namespace

LightRows::LightRows(const PrintedSheet& sheet, const ScannerTraits& traits, int width_px)
    : channels_(traits.colour ? 3 : 1),
      width_(static_cast<std::size_t>(width_px)),
      shadow_below_(traits.shadow_below),
      shadow_strength_(static_cast<float>(traits.shadow_strength)) {
  const double px_per_mm = traits.dpi / kMmPerInch;
  // CoverageRows has smeared by one pixel already, a variance of 1/12.
  const double blur_px = traits.blur_mm * px_per_mm;
  const double more_px2 = blur_px * blur_px - 1.0 / 12;
  if (more_px2 > 0) blur_taps_ = GaussianKernel(std::sqrt(more_px2));
  blur_radius_ = static_cast<int>(blur_taps_.size() / 2);
  if (shadow_strength_ > 0) shadow_taps_ = ShadowTaps(traits.shadow_mm * px_per_mm);
  shadow_rows_ = static_cast<int>(shadow_taps_.size());
  for (int channel = 0; channel < channels_; ++channel) {
    const auto index = static_cast<std::size_t>(channel);
    paper_[index] = Seen(sheet.paper, traits, channel);
    for (std::size_t ink = 0; ink < inks_.size(); ++ink) {
      inks_[ink][index] = Seen(sheet.inks[ink], traits, channel);
    }
  }
}

std::span<const float> LightRows::row(int channel, int index) const {
  return std::span(planes_[static_cast<std::size_t>(channel)])
      .subspan(static_cast<std::size_t>(index) * width_, width_);
}

void LightRows::ComputePaper(int rows) {
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels_); ++channel) {
    planes_[channel].assign(width_ * static_cast<std::size_t>(rows), paper_[channel]);
  }
}

void LightRows::Compute(std::span<const CoverageRows> coverages,
                        const std::array<bool, kInkCount>& has_ink, const CoverageRows& raised,
                        Columns columns, int rows) {
  ComputePaper(rows);
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels_); ++channel) {
    Compose(coverages, has_ink, raised, columns, rows, channel);
    Blur(columns, rows, channel);
  }
}

// The share of light that the paper of a row has left, into shade_.
void LightRows::ShadeRow(const CoverageRows& raised, Columns columns, int index) {
  const auto begin = static_cast<std::size_t>(columns.begin);
  const std::size_t count = static_cast<std::size_t>(columns.end) - begin;
  shade_.assign(count, 1.0F);
  const int away = shadow_below_ ? -1 : 1;
  for (std::size_t tap = 0; tap < shadow_taps_.size(); ++tap) {
    const auto source = raised.row(index + away * static_cast<int>(tap));
    AddScaled(source.data() + begin, -shadow_strength_ * shadow_taps_[tap], count, shade_.data());
  }
}

// Rows that the blur needs, each `columns` wide, into before_.
void LightRows::Compose(std::span<const CoverageRows> coverages,
                        const std::array<bool, kInkCount>& has_ink, const CoverageRows& raised,
                        Columns columns, int rows, std::size_t channel) {
  const auto begin = static_cast<std::size_t>(columns.begin);
  const std::size_t count = static_cast<std::size_t>(columns.end) - begin;
  const int needed = rows + 2 * blur_radius_;
  before_.resize(count * static_cast<std::size_t>(needed));
  for (int i = 0; i < needed; ++i) {
    float* out = before_.data() + static_cast<std::size_t>(i) * count;
    const int source_row = i + shadow_rows_;
    ShadeRow(raised, columns, source_row);
    for (std::size_t x = 0; x < count; ++x) out[x] = paper_[channel] * shade_[x];
    for (std::size_t ink = 0; ink < coverages.size(); ++ink) {
      if (!has_ink[ink]) continue;
      const float* cover = coverages[ink].row(source_row).data() + begin;
      const float tone = inks_[ink][channel];
      for (std::size_t x = 0; x < count; ++x) out[x] += cover[x] * (tone - out[x]);
    }
  }
}

void LightRows::Blur(Columns columns, int rows, std::size_t channel) {
  const auto begin = static_cast<std::size_t>(columns.begin);
  const std::size_t count = static_cast<std::size_t>(columns.end) - begin;
  std::vector<float>& plane = planes_[channel];
  const auto radius = static_cast<std::size_t>(blur_radius_);
  std::vector<float> column(count + 2 * radius);
  for (int i = 0; i < rows; ++i) {
    float* out = plane.data() + static_cast<std::size_t>(i) * width_ + begin;
    const float* source = before_.data() + static_cast<std::size_t>(i) * count;
    if (blur_taps_.empty()) {
      std::copy(source, source + count, out);
      continue;
    }
    std::fill(column.begin(), column.end(), 0.0F);
    float* middle = column.data() + radius;
    for (std::size_t tap = 0; tap < blur_taps_.size(); ++tap) {
      AddScaled(source + tap * count, blur_taps_[tap], count, middle);
    }
    std::fill(column.begin(), column.begin() + blur_radius_, column[radius]);
    std::fill(column.end() - blur_radius_, column.end(), column[radius + count - 1]);
    std::fill(out, out + count, 0.0F);
    for (std::size_t tap = 0; tap < blur_taps_.size(); ++tap) {
      AddScaled(column.data() + tap, blur_taps_[tap], count, out);
    }
  }
}

Sensor::Sensor(const ScannerTraits& traits, const PageFormat& format, const Random& random)
    : format_(format), texture_(static_cast<float>(traits.texture)), random_(random.Fork(2)) {
  const auto width = static_cast<std::size_t>(format.width_px);
  if (traits.texture > 0) {
    Random grain = random.Fork(0);
    const double smooth_px =
        std::min(kGrainTile / 8.0, traits.texture_mm * traits.dpi / kMmPerInch);
    grain_ = SmoothNoise(kGrainTile, smooth_px, grain);
  }
  Random noise = random.Fork(1);
  noise_.resize(kNoiseLength + width);
  for (std::size_t i = 0; i < noise_.size(); ++i) {
    noise_[i] = i < kNoiseLength ? static_cast<float>(traits.noise * noise.Normal())
                                 : noise_[i - kNoiseLength];
  }
  lamp_.resize(width);
  for (std::size_t x = 0; x < width; ++x) {
    const double off = 2 * static_cast<double>(x) / static_cast<double>(width) - 1;
    lamp_[x] = static_cast<float>(1 - traits.lamp_falloff * off * off);
  }
  gain_.resize(width);
  const double most = format.bits == 8 ? 255 : 65535;
  values_.resize(static_cast<std::size_t>(kSteps) + 1);
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const double reflectance = static_cast<double>(i) / static_cast<double>(kSteps);
    values_[i] =
        static_cast<std::uint16_t>(std::lround(most * std::pow(reflectance, 1 / traits.gamma)));
  }
}

void Sensor::Read(const LightRows& light, int index, int page_row,
                  std::span<std::uint8_t> samples) {
  const auto width = static_cast<std::size_t>(format_.width_px);
  const auto channels = static_cast<std::size_t>(format_.channels);
  std::copy(lamp_.begin(), lamp_.end(), gain_.begin());
  if (texture_ > 0) {
    const auto size = static_cast<std::size_t>(kGrainTile);
    const float* grain = grain_.value.data() + (static_cast<std::size_t>(page_row) % size) * size;
    for (std::size_t start = 0; start < width; start += size) {
      const std::size_t count = std::min(size, width - start);
      float* gain = gain_.data() + start;
      for (std::size_t x = 0; x < count; ++x) gain[x] *= 1 + texture_ * grain[x];
    }
  }
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const float* row = light.row(static_cast<int>(channel), index).data();
    const float* noise = noise_.data() + random_.Below(kNoiseLength);
    for (std::size_t x = 0; x < width; ++x) {
      const float value = row[x] * gain_[x] + noise[x];
      const auto step = static_cast<std::size_t>(
          static_cast<int>(std::min(std::max(value, 0.0F), 1.0F) * kSteps + 0.5F));
      if (format_.bits == 8) {
        samples[x * channels + channel] = static_cast<std::uint8_t>(values_[step]);
      } else {
        std::memcpy(samples.data() + 2 * (x * channels + channel), &values_[step], 2);
      }
    }
  }
}

}  // namespace trammel::sim
