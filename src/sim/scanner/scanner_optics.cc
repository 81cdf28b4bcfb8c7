#include "sim/scanner/scanner_optics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

namespace trammel::sim {

namespace {

constexpr int kCapCorners = 7;
constexpr double kUprightPx = 1e-4;  // narrower pieces count as upright: wrong by half of that

PlaneMm Beside(const StrokePoint& point, const PlaneMm& along, double left_mm) {
  return {point.centre.x_mm - along.y_mm * left_mm, point.centre.y_mm + along.x_mm * left_mm};
}

// Appends half an ellipse around the stroke's end, from one edge to the other.
void AddCap(const StrokePoint& end, const PlaneMm& out, double first_mm, double second_mm,
            const InkPlace& seen_at, InkOutline& outline) {
  for (int i = 1; i <= kCapCorners; ++i) {
    const double angle_rad = std::numbers::pi * i / (kCapCorners + 1);
    const double side = std::cos(angle_rad);
    const double beside_mm = side * (side > 0 ? first_mm : second_mm);
    const double ahead_mm = std::sin(angle_rad) * (first_mm + second_mm) / 2;
    outline.corners.push_back(
        seen_at({end.centre.x_mm + out.x_mm * ahead_mm - out.y_mm * beside_mm,
                 end.centre.y_mm + out.y_mm * ahead_mm + out.x_mm * beside_mm}));
  }
}

// Returns the share of a pixel's pyramid to the right of a vertical edge, `reach` being the
// distance of the pyramid's right end from the edge; and the sum of these shares up to a reach.
double ShareRight(double reach) {
  if (reach <= 0) return 0;
  if (reach >= 2) return 1;
  return reach < 1 ? reach * reach / 2 : 1 - (2 - reach) * (2 - reach) / 2;
}

double SumOfShares(double reach) {
  if (reach <= 0) return 0;
  if (reach >= 2) return reach - 1;
  const double left = 2 - reach;
  return reach < 1 ? reach * reach * reach / 6 : reach - 1 + left * left * left / 6;
}

}  // namespace

InkOutline OutlineOf(const InkStroke& stroke, const InkPlace& seen_at) {
  InkOutline outline;
  outline.ink = stroke.ink;
  outline.raised = stroke.raised;
  outline.weight = stroke.opacity;
  const std::vector<StrokePoint>& points = stroke.points;
  const PlaneMm back{-stroke.along.x_mm, -stroke.along.y_mm};
  outline.corners.reserve(2 * points.size() + 2 * kCapCorners);
  for (const StrokePoint& point : points) {
    outline.corners.push_back(seen_at(Beside(point, stroke.along, point.left_mm)));
  }
  AddCap(points.back(), stroke.along, points.back().left_mm, points.back().right_mm, seen_at,
         outline);
  for (auto point = points.rbegin(); point != points.rend(); ++point) {
    outline.corners.push_back(seen_at(Beside(*point, stroke.along, -point->right_mm)));
  }
  AddCap(points.front(), back, points.front().right_mm, points.front().left_mm, seen_at, outline);
  Close(outline);
  return outline;
}

void Close(InkOutline& outline) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  outline.top_px = outline.left_px = kFar;
  outline.bottom_px = outline.right_px = -kFar;
  double area = 0;
  PixelPlace last = outline.corners.back();
  for (const PixelPlace& corner : outline.corners) {
    area += last.x_px * corner.y_px - corner.x_px * last.y_px;
    last = corner;
    outline.top_px = std::min(outline.top_px, corner.y_px);
    outline.bottom_px = std::max(outline.bottom_px, corner.y_px);
    outline.left_px = std::min(outline.left_px, corner.x_px);
    outline.right_px = std::max(outline.right_px, corner.x_px);
  }
  // The area right of a descending edge is covered.
  if (area > 0) outline.weight = -outline.weight;
}

void CoverageRows::Reset(int first_row, int rows, int width) {
  first_row_ = first_row;
  rows_ = rows;
  width_ = static_cast<std::size_t>(width);
  begin_ = width;
  end_ = 0;
  stride_ = width_ + 3 * kPad;
  values_.assign(stride_ * static_cast<std::size_t>(rows), 0.0F);
}

void CoverageRows::Add(const InkOutline& outline) {
  if (outline.bottom_px + kReachPx <= first_row_ ||
      outline.top_px - kReachPx >= first_row_ + rows_) {
    return;
  }
  const auto column = [this](double x_px) {
    return static_cast<int>(std::clamp(x_px, 0.0, static_cast<double>(width_)));
  };
  begin_ = std::min(begin_, column(std::floor(outline.left_px) - kReachPx));
  end_ = std::max(end_, column(std::ceil(outline.right_px) + kReachPx + 1));
  PixelPlace last = outline.corners.back();
  for (const PixelPlace& corner : outline.corners) {
    AddEdge(last, corner, outline.weight);
    last = corner;
  }
}

void CoverageRows::AddEdge(PixelPlace from, PixelPlace to, double weight) {
  if (from.y_px == to.y_px) return;
  if (from.y_px > to.y_px) {
    std::swap(from, to);
    weight = -weight;
  }
  const double slope = (to.x_px - from.x_px) / (to.y_px - from.y_px);
  const double top = std::max(from.y_px - first_row_, -1.0);
  const double bottom = std::min(to.y_px - first_row_, rows_ + 1.0);
  // From here on, rows are counted in quarters from one row above the first.
  double y = top;
  int quarter = static_cast<int>((top + 1) * 4);
  while (y < bottom) {
    const double next_y = std::min(bottom, (quarter + 1) / 4.0 - 1);
    const double x = from.x_px + (y + first_row_ - from.y_px) * slope;
    const double next_x = from.x_px + (next_y + first_row_ - from.y_px) * slope;
    AddStep(x, next_x, quarter, weight * (next_y - y));
    y = next_y;
    ++quarter;
  }
}

// Adds a piece of an edge within a quarter of a row, which covers its right side, `height` high. It
// affects its own row and the nearer neighbouring row.
void CoverageRows::AddStep(double x_px, double next_x_px, int quarter, double height) {
  constexpr std::array<double, 4> kOwn = {5.0 / 8, 7.0 / 8, 7.0 / 8, 5.0 / 8};
  const int part = quarter % 4;
  const int own_row = quarter / 4 - 1;
  const int other_row = part < 2 ? own_row - 1 : own_row + 1;
  const auto row_of = [this](int row) {
    return row < 0 || row >= rows_
               ? nullptr
               : values_.data() + static_cast<std::size_t>(row) * stride_ + kPad;
  };
  float* own = row_of(own_row);
  float* other = row_of(other_row);
  const double own_height = height * kOwn[static_cast<std::size_t>(part)];
  const double last_px = static_cast<double>(width_) + 1;
  const double left = std::clamp(std::min(x_px, next_x_px), -1.0, last_px);
  const double right = std::clamp(std::max(x_px, next_x_px), -1.0, last_px);
  const double per_px = right - left < kUprightPx ? 0 : 1 / (right - left);
  double before = 0;
  for (int pixel = static_cast<int>(std::floor(left - 0.5)); before < 1; ++pixel) {
    const double reach = pixel + 1.5 - left;
    double share = 1;
    if (pixel + 1.5 - right < 2) {
      share = per_px == 0 ? ShareRight(reach)
                          : (SumOfShares(reach) - SumOfShares(pixel + 1.5 - right)) * per_px;
    }
    if (own != nullptr) own[pixel] += static_cast<float>(own_height * (share - before));
    if (other != nullptr)
      other[pixel] += static_cast<float>((height - own_height) * (share - before));
    before = share;
  }
}

void CoverageRows::Sum() {
  for (int index = 0; index < rows_; ++index) {
    float* row = values_.data() + static_cast<std::size_t>(index) * stride_ + kPad;
    float sum = row[-2] + row[-1];
    for (int x = begin_; x < end_; ++x) {
      sum += row[x];
      row[x] = std::clamp(sum, 0.0F, 1.0F);
    }
  }
}

namespace {

constexpr double kMmPerInch = 25.4;
constexpr std::array<double, 3> kGreyWeights = {0.299, 0.587, 0.114};
constexpr int kGrainTile = 512;
constexpr std::size_t kNoiseLength = std::size_t{1} << 16;
constexpr float kSteps = 65535;

// Computes one channel's value of a colour; a grey scanner mixes the three.
float Seen(const LinearRgb& colour, const ScannerTraits& traits, int channel) {
  if (traits.colour) {
    const auto index = static_cast<std::size_t>(channel);
    return static_cast<float>(colour[index] * traits.cast[index]);
  }
  double grey = 0;
  for (std::size_t i = 0; i < 3; ++i) grey += kGreyWeights[i] * colour[i] * traits.cast[i];
  return static_cast<float>(grey);
}

// Returns the shares of the shading rows: light is lost evenly over `length_px` before a row.
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
  // CoverageRows has already blurred by one pixel, a variance of 1/12.
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

// Computes the share of light remaining on a row's paper, into shade_.
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

// Computes the rows that the blur needs, each `columns` wide, into before_.
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
