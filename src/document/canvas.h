// Colours, and a canvas with output to PNG, SVG and PDF.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/frame.h"

namespace trammel::report {

/// sRGB, each 0 … 1.
struct Color {
  double red = 0;
  double green = 0;
  double blue = 0;
  double alpha = 1;
};

[[nodiscard]] constexpr Color Rgb(unsigned hex, double alpha = 1) {
  return {static_cast<double>((hex >> 16) & 0xffU) / 255,
          static_cast<double>((hex >> 8) & 0xffU) / 255, static_cast<double>(hex & 0xffU) / 255,
          alpha};
}

[[nodiscard]] constexpr Color WithAlpha(const Color& color, double alpha) {
  return {color.red, color.green, color.blue, alpha};
}

inline constexpr Color kInk = Rgb(0x1d2430);
inline constexpr Color kMuted = Rgb(0x5a6472);
inline constexpr Color kGrid = Rgb(0xe3e7ec);
inline constexpr Color kPaper = Rgb(0xffffff);
inline constexpr Color kUnseen = Rgb(0xd9dce1);  ///< areas without measurements

// Distinguishable with every common form of colour blindness, and in grey by their lightness (50,
// 67, 80): after Okabe & Ito, Color Universal Design (2008).
inline constexpr Color kBlue = Rgb(0x0a5fa5);
inline constexpr Color kVermilion = Rgb(0xd9631e);
inline constexpr Color kSky = Rgb(0x56b4e9);
inline constexpr Color kGreen = Rgb(0x00734f);
inline constexpr Color kGrey = Rgb(0x8a94a3);

/// Colours of letters on a map's colours: the same in light and dark mode.
inline constexpr Color kOnLight = Rgb(0x11161d);
inline constexpr Color kOnDark = Rgb(0xfcfdfe);

/// Colour of the palette, and its replacement on a dark card.
struct PaletteColor {
  Color light;
  Color dark;
};
inline constexpr Color kDarkCard = Rgb(0x1d232b);
inline constexpr std::array<PaletteColor, 10> kPalette = {{{kInk, Rgb(0xe8ecf1)},
                                                           {kMuted, Rgb(0xa3adba)},
                                                           {kGrid, Rgb(0x353e49)},
                                                           {kPaper, kDarkCard},
                                                           {kUnseen, Rgb(0x4a535f)},
                                                           {kBlue, Rgb(0x63aef0)},
                                                           {kVermilion, Rgb(0xf28a4e)},
                                                           {kSky, Rgb(0x8fd0f5)},
                                                           {kGreen, Rgb(0x4cc79d)},
                                                           {kGrey, Rgb(0x8a94a3)}}};

/// "#1d2430", without the alpha.
[[nodiscard]] std::string HexText(const Color& color);

/// Returns CSS rules that replace the palette's colours in inline SVG for a dark card; pictures and
/// map colours are unchanged.
[[nodiscard]] std::string DarkPaletteStyle();

/// Returns a colour from dark violet to light yellow. Its lightness (CIE L*) rises evenly: equal
/// steps look equal, also in a grey copy. @param fraction  clamped to 0 … 1; NaN gives 0.
[[nodiscard]] Color MapColor(double fraction);

/// Returns the CIE 1976 lightness of an opaque colour, 0 … 100.
[[nodiscard]] double Lightness(const Color& color);

/// Point on a canvas: x right, y down, (0, 0) its upper left corner, in px of a page at scale 1.
struct PointPx {
  double x = 0;
  double y = 0;
};

struct RectPx {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;

  [[nodiscard]] double right() const { return x + width; }
  [[nodiscard]] double bottom() const { return y + height; }
};

struct Stroke {
  Color color = kInk;
  double width_px = 1.5;
  std::vector<double> dash_px = {};  ///< lengths on and off; empty: solid
  bool round_ends = false;           ///< half a width beyond the end points
};

/// Encoding of a picture in an SVG: exact pixels or JPEG.
enum class Pixels { kExact, kPhoto };

/// Resolution and quality of the photos in an SVG.
struct PhotoDetail {
  double density = 1.5;  ///< most pixels per px of the canvas, (0, 1.5]
  int quality = 75;      ///< JPEG quality, 1 … 100
};

enum class Align { kStart, kMiddle, kEnd };

struct TextStyle {
  double size_px = 12;
  Color color = kInk;
  Align align = Align::kStart;
  bool bold = false;
  double angle_rad = 0;  ///< clockwise
};

/// Records strokes and replays them, so that both formats look the same. Equal drawings give equal
/// bytes. Omits points that are not finite. Font: DejaVu Sans; text from outside may contain any
/// bytes (Utf8OrReplaced). Not thread-safe.
class Canvas {
 public:
  /// Creates a white canvas. REQUIRES 0 < width_px, height_px <= 8192.
  Canvas(double width_px, double height_px);
  ~Canvas();
  Canvas(Canvas&&) noexcept;
  Canvas& operator=(Canvas&&) noexcept;

  [[nodiscard]] double width_px() const { return width_px_; }
  [[nodiscard]] double height_px() const { return height_px_; }

  void FillRect(const RectPx& rect, const Color& fill);
  void StrokeRect(const RectPx& rect, const Stroke& stroke);
  /// Draws a line, broken at points that are not finite.
  void Polyline(std::span<const PointPx> points, const Stroke& stroke);
  /// Fills a polygon and strokes its edge, if given. Draws nothing unless all points are finite.
  void Polygon(std::span<const PointPx> points, const Color& fill,
               const std::optional<Stroke>& edge = std::nullopt);
  void Circle(const PointPx& centre, double radius_px, const std::optional<Color>& fill,
              const std::optional<Stroke>& edge = std::nullopt);
  /// `at` is on the baseline.
  void Text(const PointPx& at, std::string_view text, const TextStyle& style);
  [[nodiscard]] double TextWidth(std::string_view text, const TextStyle& style) const;
  /// Scales the picture into `to`: enlarged pixels remain squares, reduced ones are averaged.
  void Image(const BgrView& image, const RectPx& to, Pixels pixels = Pixels::kExact);

  /// Clips drawing to `rect` until Unclip().
  void Clip(const RectPx& rect);
  void Unclip();

  /// @param scale  px of the picture per px of the canvas, (0, 4].
  [[nodiscard]] std::string ToPng(double scale = 2) const;
  /// Returns one picture of several drawings below each other, as wide as the widest. REQUIRES at
  /// least one.
  [[nodiscard]] static std::string StackedPng(std::span<const Canvas* const> drawings,
                                              double scale = 2);
  [[nodiscard]] std::string ToSvg() const;
  /// Returns an element for an HTML page, whose style changes the palette in dark mode
  /// (DarkPaletteStyle).
  /// @param label  description for blind readers.
  [[nodiscard]] std::string ToSvgElement(std::string_view label,
                                         const PhotoDetail& detail = {}) const;

 private:
  struct State;
  void SetStroke(const Stroke& stroke);
  void SetFont(const TextStyle& style) const;

  double width_px_ = 0;
  double height_px_ = 0;
  std::unique_ptr<State> state_;
};

}  // namespace trammel::report
