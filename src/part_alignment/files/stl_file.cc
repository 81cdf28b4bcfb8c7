#include "part_alignment/files/stl_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

#include "files/whole_file.h"
#include "part_alignment/mesh/solid_mesh.h"
#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::files {
namespace {

using Eigen::Vector3d;
using part_alignment::kMaxTriangles;
using part_alignment::Triangle;
using part_alignment::TriangleMesh;
using part_alignment::VertexWeld;

constexpr std::size_t kHeaderBytes = 84;
constexpr std::size_t kTriangleBytes = 50;
constexpr std::string_view kCoarser =
    "export it with a coarser deflection (0.01 mm is fine enough for most parts)";

std::uint32_t Word(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = (word << 8) | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

Result<void> TooMany(const std::string& file, std::size_t count) {
  return Fail(fmt::format("{}: {} triangles; at most {} are read: {}", file, count, kMaxTriangles,
                          kCoarser));
}

Result<TriangleMesh> ParseBinary(std::string_view bytes, const std::string& file,
                                 double mm_per_unit) {
  const std::size_t count = Word(bytes, kHeaderBytes - 4);
  TriangleMesh mesh;
  mesh.triangles.reserve(count);
  VertexWeld weld;
  for (std::size_t t = 0; t < count; ++t) {
    const std::size_t at = kHeaderBytes + kTriangleBytes * t + 12;  // behind the normal
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3d corner;
      for (std::size_t i = 0; i < 3; ++i) {
        const float number = std::bit_cast<float>(Word(bytes, at + 12 * k + 4 * i));
        if (!std::isfinite(number)) {
          return Fail(
              fmt::format("{}: triangle {} of {} has a corner that is no number ({}); "
                          "export it anew",
                          file, t + 1, count, number));
        }
        corner[static_cast<Eigen::Index>(i)] = static_cast<double>(number) * mm_per_unit;
      }
      triangle[k] = weld.Number(corner);
    }
    mesh.triangles.push_back(triangle);
  }
  mesh.vertices_mm = weld.Take();
  return mesh;
}

bool SameWord(std::string_view a, std::string_view lower) {
  return a.size() == lower.size() &&
         std::equal(a.begin(), a.end(), lower.begin(), [](char x, char y) {
           return (x >= 'A' && x <= 'Z' ? static_cast<char>(x - 'A' + 'a') : x) == y;
         });
}

// Splits a text into words, in order.
class Words {
 public:
  Words(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  // Returns the next word; empty at the end.
  std::string_view Next() {
    while (at_ < text_.size() && IsSpace(text_[at_])) ++at_;
    const std::size_t begin = at_;
    while (at_ < text_.size() && !IsSpace(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  void SkipLine() { at_ = std::min(text_.find('\n', at_), text_.size()); }
  [[nodiscard]] Result<void> Expect(std::string_view word) {
    const std::string_view next = Next();
    if (SameWord(next, word)) return {};
    return Wrong(next, fmt::format("\"{}\"", word));
  }
  [[nodiscard]] Result<double> Number() {
    std::string_view word = Next();
    const std::string_view whole = word;
    if (word.starts_with('+')) word.remove_prefix(1);
    double number = 0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), number);
    if (read.ec == std::errc{} && read.ptr == word.data() + word.size() && !word.empty() &&
        std::isfinite(number)) {
      return number;
    }
    return tl::unexpected(Wrong(whole, "a finite number (with a point)").error());
  }
  [[nodiscard]] Result<void> Wrong(std::string_view word, const std::string& wanted) const {
    const auto line =
        1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n');
    if (word.empty()) {
      return Fail(
          fmt::format("{}:{}: the file ends where {} is wanted: it is cut short; export it "
                      "anew",
                      file_, line, wanted));
    }
    return Fail(fmt::format("{}:{}: \"{}\" stands where {} is wanted", file_, line,
                            word.substr(0, 40), wanted));
  }

 private:
  static bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
};

Result<Vector3d> Three(Words& words) {
  Vector3d three;
  for (double& number : three) {
    number = TRY(words.Number());
  }
  return three;
}

// Reads a triangle behind "facet". Skips normals as words: some programs write "nan" for that of a
// narrow triangle.
Result<Triangle> Facet(Words& words, VertexWeld& weld, double mm_per_unit) {
  TRY(words.Expect("normal"));
  for (int i = 0; i < 3; ++i) words.Next();
  for (const std::string_view word : {"outer", "loop"}) {
    TRY(words.Expect(word));
  }
  Triangle triangle{};
  for (std::uint32_t& corner : triangle) {
    TRY(words.Expect("vertex"));
    const auto at = TRY(Three(words));
    corner = weld.Number(at * mm_per_unit);
  }
  for (const std::string_view word : {"endloop", "endfacet"}) {
    TRY(words.Expect(word));
  }
  return triangle;
}

Result<TriangleMesh> ParseText(std::string_view text, const std::string& file, double mm_per_unit) {
  Words words(text, file);
  TriangleMesh mesh;
  VertexWeld weld;
  bool within = false;
  while (true) {
    const std::string_view word = words.Next();
    if (word.empty() && !within) break;
    if (!within && SameWord(word, "solid")) {
      within = true;
      words.SkipLine();  // solid's name
    } else if (within && SameWord(word, "endsolid")) {
      within = false;
      words.SkipLine();
    } else if (within && SameWord(word, "facet")) {
      const auto triangle = TRY(Facet(words, weld, mm_per_unit));
      mesh.triangles.push_back(triangle);
      if (mesh.triangles.size() > kMaxTriangles) {
        return tl::unexpected(TooMany(file, mesh.triangles.size()).error());
      }
    } else {
      return tl::unexpected(
          words.Wrong(word, within ? "\"facet\" or \"endsolid\"" : "\"solid\"").error());
    }
  }
  mesh.vertices_mm = weld.Take();
  return mesh;
}

bool LooksLikeText(std::string_view bytes) {
  constexpr std::size_t kLooked = 1000;
  const std::string_view head = bytes.substr(0, kLooked);
  if (head.find('\0') != std::string_view::npos) return false;
  const std::size_t first = head.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && SameWord(head.substr(first, 5), "solid");
}

}  // namespace

std::optional<LengthUnit> LengthUnitOf(std::string_view name) {
  for (const LengthUnit& unit : {LengthUnit{"mm", 1}, LengthUnit{"cm", 10}, LengthUnit{"m", 1000},
                                 LengthUnit{"inch", 25.4}}) {
    if (unit.name == name) return unit;
  }
  return std::nullopt;
}

Result<MeshFile> MakeMeshFile(const std::filesystem::path& path,
                              part_alignment::TriangleMesh triangles, bool open,
                              const std::string& read) {
  auto solid = part_alignment::MakeSolid(std::move(triangles), open);
  if (!solid) {
    return Fail(fmt::format("{}: {}", path.string(), solid.error().message));
  }
  MeshFile made;
  const std::string name = path.filename().string();
  const std::vector<std::string> mended = std::move(solid->notices);
  auto mesh = std::make_shared<part_alignment::MeshDistance>(std::move(*solid));
  Eigen::Vector3d low = mesh->mesh().vertices_mm.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& at : mesh->mesh().vertices_mm) {
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  const Eigen::Vector3d extent = high - low;
  made.notices.push_back(fmt::format("{}: {} triangles, {:.6g} × {:.6g} × {:.6g} mm, {}", name,
                                     mesh->mesh().triangles.size(), extent.x(), extent.y(),
                                     extent.z(), read));
  for (const std::string& notice : mended) {
    made.notices.push_back(fmt::format("{}: {}", name, notice));
  }
  if (mesh->slivers() > 0) {
    made.notices.push_back(
        fmt::format("{}: {} triangles are too narrow to have a normal and take their neighbours'",
                    name, mesh->slivers()));
  }
  made.mesh = std::move(mesh);
  return made;
}

std::size_t StlTrailingBytes(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes || LooksLikeText(bytes)) return 0;
  const std::size_t stated = kTriangleBytes * Word(bytes, kHeaderBytes - 4);
  if (bytes.size() <= kHeaderBytes + stated) return 0;
  const std::size_t trailing = bytes.size() - kHeaderBytes - stated;
  // Whole triangles are ones that the file does not count, and a file that states none states
  // nothing about the rest.
  return trailing < stated && trailing % kTriangleBytes != 0 ? trailing : 0;
}

Result<TriangleMesh> ParseStl(std::string_view bytes, const std::string& file, double mm_per_unit) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  const std::size_t stated =
      bytes.size() >= kHeaderBytes ? Word(bytes, kHeaderBytes - 4) : std::size_t{0};
  const std::size_t wanted = kHeaderBytes + kTriangleBytes * stated;
  if (bytes.size() >= kHeaderBytes && bytes.size() == wanted + StlTrailingBytes(bytes)) {
    if (stated > kMaxTriangles) return tl::unexpected(TooMany(file, stated).error());
    return ParseBinary(bytes, file, mm_per_unit);
  }
  if (LooksLikeText(bytes)) return ParseText(bytes, file, mm_per_unit);
  if (bytes.size() < kHeaderBytes) {
    return Fail(
        fmt::format("{}: {} bytes are no STL: neither text that begins with \"solid\" nor "
                    "the {} bytes with which a binary one begins",
                    file, bytes.size(), kHeaderBytes));
  }
  return Fail(
      fmt::format("{}: no STL, or a damaged one: as a binary one it states {} triangles, "
                  "which are {} bytes; it has {}{}: export or copy it anew",
                  file, stated, wanted, bytes.size(),
                  bytes.size() < wanted ? ", so that it is cut short"
                  : (bytes.size() - wanted) % kTriangleBytes == 0
                      ? fmt::format(", {} triangles more", (bytes.size() - wanted) / kTriangleBytes)
                      : ""));
}

Result<MeshFile> ReadMeshFile(const std::filesystem::path& path,
                              const std::optional<LengthUnit>& unit, bool open) {
  constexpr std::size_t kMaxBytes = kHeaderBytes + kTriangleBytes * kMaxTriangles;
  constexpr double kBytesPerMb = 1e6;
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(path, unknown);
  if (!unknown && size > kMaxBytes) {
    return Fail(
        fmt::format("{}: {:.0f} MB, {:.1f} million triangles of a binary STL; {:.0f} MB "
                    "are read at most: {}",
                    path.string(), static_cast<double>(size) / kBytesPerMb,
                    static_cast<double>(size) / kTriangleBytes / kBytesPerMb,
                    kMaxBytes / kBytesPerMb, kCoarser));
  }
  Result<TriangleMesh> triangles;
  std::size_t trailing = 0;
  {
    const auto bytes = TRY(ReadNamedFile(path, kMaxBytes));
    triangles = ParseStl(bytes, path.string(), unit ? unit->mm : 1);
    trailing = StlTrailingBytes(bytes);
  }
  if (!triangles) return tl::unexpected(triangles.error());
  std::string read = unit ? fmt::format("read in {}", unit->name)
                          : "read in mm: an STL states no unit, \"unit\" or --unit says another";
  if (trailing > 0) {
    read +=
        fmt::format("; {} bytes behind the last triangle are none, and were not read", trailing);
  }
  return MakeMeshFile(path, std::move(*triangles), open, read);
}

}  // namespace trammel::files
