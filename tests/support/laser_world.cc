#include "support/laser_world.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "support/test_pictures.h"

namespace trammel::test {
namespace {

void Put32(std::string& out, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) {
    out.push_back(static_cast<char>(value >> (8 * i)));
  }
}

std::string Chunk(const std::string& name, const std::string& content) {
  std::string out = name;
  Put32(out, static_cast<std::uint32_t>(content.size()));
  out += content;
  if (content.size() % 2 != 0) {
    out.push_back('\0');
  }
  return out;
}

std::string Words(std::initializer_list<std::uint32_t> words) {
  std::string out;
  for (const std::uint32_t word : words) {
    Put32(out, word);
  }
  return out;
}

}  // namespace

Frame DrawLaserFrame(const LaserWorld& world, double area_mm2, Random& random) {
  const double height_mm = std::min(std::sqrt(area_mm2 * 0.75), world.highest_mm);
  const double half_width_mm = height_mm > 0 ? area_mm2 * 0.75 / height_mm : 0;
  Frame frame(world.width, world.height);
  for (int y = 0; y < world.height; ++y) {
    const double off = (y - world.bead_row_px) / world.px_per_mm;
    const double rise =
        height_mm > 0 ? height_mm * std::max(0.0, 1 - off * off / (half_width_mm * half_width_mm))
                      : 0;
    const double centre =
        world.plate_column_px + world.tilt * (y - world.bead_row_px) - rise * world.px_per_mm;
    const double amplitude = rise > 0 ? world.bead_amplitude : world.plate_amplitude;
    for (int x = 0; x < world.width; ++x) {
      const double t = (x - centre) / world.stripe_sigma_px;
      const double light =
          amplitude * std::exp(-0.5 * t * t) * std::max(0.0, 1 + world.speckle * random.Normal());
      for (int c = 0; c < 3; ++c) {
        const double level = world.ambient + (c == 2 ? light : 0.6 * std::max(0.0, light - 170)) +
                             world.noise * random.Normal();
        frame.row(y)[3 * x + c] =
            static_cast<std::uint8_t>(std::clamp(std::round(level), 0.0, 255.0));
      }
    }
  }
  return frame;
}

void WriteAvi(const std::filesystem::path& path, const std::vector<Frame>& frames,
              std::uint32_t announced_frames) {
  const std::uint32_t width = frames.empty() ? 64 : static_cast<std::uint32_t>(frames[0].width);
  const std::uint32_t height = frames.empty() ? 64 : static_cast<std::uint32_t>(frames[0].height);
  const std::uint32_t mjpg = 0x47504A4D;
  const std::string main_header =
      Words({33333, 0, 0, 0x10, announced_frames, 0, 1, 0, width, height, 0, 0, 0, 0});
  const std::string stream_header =
      "vids" + Words({mjpg, 0, 0, 0, 1, 30, 0, announced_frames, 0, 0xFFFFFFFF, 0, 0, 0});
  const std::string format =
      Words({40, width, height, (24U << 16) | 1U, mjpg, width * height * 3, 0, 0, 0, 0});
  const std::string stream = "strl" + Chunk("strh", stream_header) + Chunk("strf", format);
  std::string movie = "movi";
  for (const Frame& frame : frames) {
    movie += Chunk("00dc", JpegOf(frame, 95));
  }
  const std::string list = "hdrl" + Chunk("avih", main_header) + Chunk("LIST", stream);
  const std::string file = Chunk("RIFF", "AVI " + Chunk("LIST", list) + Chunk("LIST", movie));
  std::ofstream(path, std::ios::binary) << file;
}

}  // namespace trammel::test
