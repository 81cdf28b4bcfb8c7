#include "vision/segment_digits.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::vision {
namespace {

constexpr double kAround_mm = 4;  // shown beside each label: the largest offset, and a section
constexpr double kSample_mm = 0.2;
constexpr double kPieceMargin_mm = 0.1;  // left out at either end of a piece
constexpr int kLevels = 3;               // heights of level strokes: 0, 2, 4 mm
constexpr int kQuarters = 4;             // of an upright stroke over two segments

constexpr int kSize = 3 * kStrokeSamples;
using Section = Eigen::Matrix<double, kSize, 1>;

// Segments of a digit, one bit each.
enum Segment : unsigned {
  kBottom = 1,
  kMiddle = 2,
  kTop = 4,
  kLowLeft = 8,
  kLowRight = 16,
  kHighLeft = 32,
  kHighRight = 64
};

unsigned SegmentsOf(char digit, const DigitStyle& style) {
  constexpr unsigned kLeft = kLowLeft | kHighLeft, kRight = kLowRight | kHighRight;
  switch (digit) {
    case '0':
      return kBottom | kTop | kLeft | kRight;
    case '2':
      return kTop | kHighRight | kMiddle | kLowLeft | kBottom;
    case '3':
      return kTop | kRight | kMiddle | kBottom;
    case '4':
      return kHighLeft | kMiddle | kRight;
    case '5':
      return kTop | kHighLeft | kMiddle | kLowRight | kBottom;
    case '6':
      return kTop | kLeft | kMiddle | kLowRight | kBottom;
    case '7':
      return kTop | kRight;
    case '8':
      return kTop | kMiddle | kBottom | kLeft | kRight;
    case '9':
      return kTop | kHighLeft | kMiddle | kRight | (style.nine_foot ? kBottom : 0U);
    default:
      return 0;
  }
}

int AdvanceOf(char character, const DigitStyle& style) {
  return style.narrow && (character == '1' || character == '.') ? 1 : 3;
}

// Calls `level(x, height)` and `upright(x, quarter)` for each piece of 1 mm of a text.
template <class Level, class Upright>
void ForPieces(std::string_view text, const DigitStyle& style, Level level, Upright upright) {
  int at = 0;
  const auto half = [&](int x, bool high) {
    upright(x, high ? 2 : 0);
    upright(x, high ? 3 : 1);
  };
  for (const char character : text) {
    const int thin = at + (style.narrow ? 0 : 1);
    if (character == '1') {
      half(thin, false);
      half(thin, true);
    } else if (character == '.') {
      upright(thin, 0);
    }
    const unsigned segments = SegmentsOf(character, style);
    for (int height = 0; height < kLevels; ++height) {
      if ((segments & (1U << height)) == 0) continue;
      level(at, height);
      level(at + 1, height);
    }
    if (segments & kLowLeft) half(at, false);
    if (segments & kLowRight) half(at + 2, false);
    if (segments & kHighLeft) half(at, true);
    if (segments & kHighRight) half(at + 2, true);
    at += AdvanceOf(character, style);
  }
}

Eigen::Map<const Section> AsVector(const StrokeSection& section) {
  return Eigen::Map<const Section>(section.data());
}

// Limits each section's size: glints, edges of the tab and hidden places must not outweigh the
// strokes.
void Compress(std::vector<std::vector<StrokeSection>>& sections) {
  std::vector<double> sizes;
  for (const auto& label : sections) {
    for (const StrokeSection& section : label) sizes.push_back(AsVector(section).norm());
  }
  constexpr double kUsual = 0.75;
  const double usual = std::max(1e-6, Quantile(sizes, kUsual));
  for (auto& label : sections) {
    for (StrokeSection& section : label) {
      Eigen::Map<Section> vector(section.data());
      vector /= std::sqrt(vector.squaredNorm() + usual * usual);
    }
  }
}

// Moves the mean to zero and scales so that all directions scatter alike.
std::size_t Whiten(std::vector<std::vector<StrokeSection>>& sections) {
  Section mean = Section::Zero();
  std::size_t count = 0;
  for (const auto& label : sections) {
    for (const StrokeSection& section : label) mean += AsVector(section);
    count += label.size();
  }
  mean /= static_cast<double>(count);
  Eigen::Matrix<double, kSize, kSize> scatter = Eigen::Matrix<double, kSize, kSize>::Zero();
  for (auto& label : sections) {
    for (StrokeSection& section : label) {
      Eigen::Map<Section> off(section.data());
      off -= mean;
      for (int i = 0; i < kSize; ++i)
        scatter.col(i).tail(kSize - i) += off(i) * off.tail(kSize - i);
    }
  }
  scatter /= static_cast<double>(count);  // its lower triangle
  // Sections have no mean, and neighbouring samples hardly differ: little variance is noise.
  constexpr double kNoise = 0.1;
  scatter.diagonal().array() += std::max(1e-12, kNoise * scatter.trace() / kSize);
  const Eigen::Matrix<double, kSize, kSize> root = scatter.llt().matrixL();
  const Section inverse = root.diagonal().cwiseInverse();
  for (auto& label : sections) {
    for (StrokeSection& section : label) {
      // Forward substitution, along the columns.
      Eigen::Map<Section> off(section.data());
      for (int i = 0; i < kSize; ++i) {
        off(i) *= inverse(i);
        off.tail(kSize - i - 1) -= off(i) * root.col(i).tail(kSize - i - 1);
      }
    }
  }
  return count;
}

double LogLikelihoodOf(const StrokeSection& sum, int pieces, std::size_t places) {
  // Neighbouring places share texture: they count as fewer.
  constexpr double kIndependent = 0.5;
  const auto n = static_cast<double>(places);
  if (pieces == 0 || pieces >= n) return 0;
  const double explained = AsVector(sum).squaredNorm() / (pieces * (n - pieces));
  return -kIndependent * n / 2 * std::log(std::max(1e-6, 1 - explained));
}

}  // namespace

double LengthOf_mm(std::string_view text, const DigitStyle& style) {
  int length = 0;
  for (const char character : text) length += AdvanceOf(character, style);
  return std::max(0, length - 1);
}

namespace {

constexpr std::string_view kCharacters = ".0123456789";  // others have no strokes

}  // namespace

GlyphSums StrokeTable::SumsOf(const DigitStyle& style) const {
  GlyphSums sums;
  sums.style_ = style;
  sums.units_ = static_cast<std::size_t>(units_) + 1;
  sums.sums_.resize(level_.size() * sums.units_ * kCharacters.size());
  const auto add = [](const StrokeSection& section, StrokeSection& to) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += section[i];
  };
  auto sum = sums.sums_.begin();
  for (std::size_t label = 0; label < level_.size(); ++label) {
    for (int at = 0; at <= units_; ++at) {
      for (const char character : kCharacters) {
        ForPieces(
            {&character, 1}, style,
            [&](int x, int height) {
              if (at + x >= units_) return;
              add(level_[label][(at + x) * kLevels + height], sum->level);
              ++sum->levels;
            },
            [&](int x, int quarter) {
              if (at + x > units_) return;
              add(upright_[label][(at + x) * kQuarters + quarter], sum->upright);
              ++sum->uprights;
            });
        ++sum;
      }
    }
  }
  return sums;
}

void GlyphSums::Add(std::size_t label, std::string_view text, StrokeSum& total) const {
  std::size_t at = 0;
  for (const char character : text) {
    if (at >= units_) return;
    const std::size_t index = kCharacters.find(character);
    if (index < kCharacters.size()) {
      total.Add(sums_[(label * units_ + at) * kCharacters.size() + index]);
    }
    at += static_cast<std::size_t>(AdvanceOf(character, style_));
  }
}

double StrokeTable::LogLikelihood(const StrokeSum& total) const {
  return LogLikelihoodOf(total.level, total.levels, levels_) +
         LogLikelihoodOf(total.upright, total.uprights, uprights_);
}

LabelRow::LabelRow(const BgrView& photo, const std::vector<Homography>& photo_from_label,
                   int longest_mm)
    : units_(longest_mm) {
  TRAMMEL_CHECK(!photo_from_label.empty() && longest_mm >= 1 && longest_mm <= 20,
                "{} labels, {} mm", photo_from_label.size(), longest_mm);
  const Homography& middle = photo_from_label[photo_from_label.size() / 2];
  const double x = longest_mm / 2.0;
  photo_px_per_mm_ = std::min(Distance_px(middle({x, 2}), middle({x + 1, 2})),
                              Distance_px(middle({x, 2}), middle({x, 3})));
  if (!std::isfinite(photo_px_per_mm_)) photo_px_per_mm_ = 0;
  constexpr double kLeast = 5, kMost = 16;  // px/mm: a sample has 1 to 3 px
  px_per_mm_ = std::clamp(photo_px_per_mm_, kLeast, kMost);
  constexpr double kCell_mm = 4;
  const int width = static_cast<int>((longest_mm + 2 * kAround_mm) * px_per_mm_);
  const int height = static_cast<int>((kCell_mm + 2 * kAround_mm) * px_per_mm_);
  const double s = 1 / px_per_mm_;
  // Shading is a factor of brightness; the offset bounds the noise of dark pixels.
  constexpr double kDark = 12;
  std::array<double, 256> brightness;
  for (int level = 0; level < 256; ++level) brightness[level] = std::log(level + kDark);
  for (const Homography& from_label : photo_from_label) {
    const Homography label_from_picture{
        {s, 0, s / 2 - kAround_mm, 0, -s, kCell_mm + kAround_mm - s / 2, 0, 0, 1}};
    const Frame picture = Rectify(photo, Product(from_label, label_from_picture), width, height);
    Label label{width, height, {}};
    label.sum.resize(static_cast<std::size_t>(width + 1) * (height + 1));
    for (int py = 0; py < height; ++py) {
      const Colour* above = &label.sum[static_cast<std::size_t>(py) * (width + 1) + 1];
      Colour* sum = &label.sum[static_cast<std::size_t>(py + 1) * (width + 1) + 1];
      const std::uint8_t* pixel = picture.view().row(py);
      Colour row{};
      for (int px = 0; px < width; ++px, pixel += 3) {
        for (int c = 0; c < 3; ++c) {
          row[c] += brightness[pixel[c]];
          sum[px][c] = above[px][c] + row[c];
        }
      }
    }
    labels_.push_back(std::move(label));
  }
}

LabelRow::Colour LabelRow::SumTo(const Label& label, double x_mm, double y_mm) const {
  constexpr double kCell_mm = 4;
  const double x = (x_mm + kAround_mm) * px_per_mm_;
  const double y = (kCell_mm + kAround_mm - y_mm) * px_per_mm_;
  const int ix = std::clamp(static_cast<int>(x), 0, label.width - 1);
  const int iy = std::clamp(static_cast<int>(y), 0, label.height - 1);
  const double fx = std::clamp(x - ix, 0.0, 1.0), fy = std::clamp(y - iy, 0.0, 1.0);
  const Colour* p = &label.sum[static_cast<std::size_t>(iy) * (label.width + 1) + ix];
  const Colour* q = p + label.width + 1;
  Colour sum;
  for (int c = 0; c < 3; ++c) {
    sum[c] =
        (1 - fy) * ((1 - fx) * p[0][c] + fx * p[1][c]) + fy * ((1 - fx) * q[0][c] + fx * q[1][c]);
  }
  return sum;
}

// Returns the mean of each sample less that of all.
StrokeSection LabelRow::SectionAt(const Label& label, double x_mm, double y_mm,
                                  bool upright) const {
  constexpr double kHalf_mm = 0.5 - kPieceMargin_mm;
  const double area_px2 = kSample_mm * 2 * kHalf_mm * px_per_mm_ * px_per_mm_;
  const auto between = [&](int edge) {
    const double across = (edge - kStrokeSamples / 2.0) * kSample_mm;
    const double x = x_mm + (upright ? across : kHalf_mm),
                 y = y_mm + (upright ? -kHalf_mm : across);
    const double x0 = upright ? x : x_mm - kHalf_mm, y0 = upright ? y_mm + kHalf_mm : y;
    Colour sum = SumTo(label, x, y);
    const Colour other = SumTo(label, x0, y0);
    for (int c = 0; c < 3; ++c) sum[c] -= other[c];
    return sum;
  };
  StrokeSection result{};
  Colour total{};
  Colour last = between(0);
  for (int i = 0; i < kStrokeSamples; ++i) {
    const Colour next = between(i + 1);
    for (int c = 0; c < 3; ++c) {
      result[3 * i + c] = (upright ? next[c] - last[c] : last[c] - next[c]) / area_px2;
      total[c] += result[3 * i + c] / kStrokeSamples;
    }
    last = next;
  }
  for (int i = 0; i < kStrokeSamples; ++i) {
    for (int c = 0; c < 3; ++c) result[3 * i + c] -= total[c];
  }
  return result;
}

StrokeTable LabelRow::TableAt(const LabelOffset& offset) const {
  StrokeTable table;
  table.units_ = units_;
  const auto section = [&](const Label& label, double x_mm, double y_mm, bool upright) {
    return SectionAt(label, offset.along_mm + offset.scale * x_mm,
                     offset.up_mm + offset.scale * y_mm, upright);
  };
  for (const Label& label : labels_) {
    auto& level = table.level_.emplace_back();
    auto& upright = table.upright_.emplace_back();
    for (int x = 0; x <= units_; ++x) {
      for (int height = 0; height < kLevels && x < units_; ++height) {
        level.push_back(section(label, x + 0.5, 2 * height, false));
      }
      // Edges of a tab or a bar go on below and above the cells.
      constexpr double kBelow_mm = -0.9, kAbove_mm = 4.9;
      const StrokeSection below = section(label, x, kBelow_mm, true);
      const StrokeSection above = section(label, x, kAbove_mm, true);
      for (int quarter = 0; quarter < kQuarters; ++quarter) {
        StrokeSection& here = upright.emplace_back(section(label, x, quarter + 0.5, true));
        for (std::size_t i = 0; i < here.size(); ++i) here[i] -= (below[i] + above[i]) / 2;
      }
    }
  }
  Compress(table.level_);
  Compress(table.upright_);
  table.levels_ = Whiten(table.level_);
  table.uprights_ = Whiten(table.upright_);
  return table;
}

}  // namespace trammel::vision
