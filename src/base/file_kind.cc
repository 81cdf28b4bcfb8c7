#include "base/file_kind.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>

namespace trammel {
namespace {

using std::string_view_literals::operator""sv;

constexpr std::string_view kUnpack = "unpack it, and give the file that is in it";
constexpr std::string_view kPicture = "it is a picture; name another file";
constexpr std::string_view kOther = "name another file";

struct Signature {
  std::size_t at;
  std::string_view with;
  FileKind kind;
};

constexpr std::array kSignatures = {
    Signature{0, "PK\3\4"sv, {"a ZIP archive", kUnpack, true}},
    Signature{0, "PK\5\6"sv, {"an empty ZIP archive", kUnpack, true}},
    Signature{0, "\x1f\x8b"sv, {"a gzip archive", kUnpack, true}},
    Signature{0, "7z\xbc\xaf\x27\x1c"sv, {"a 7-Zip archive", kUnpack, true}},
    Signature{0, "Rar!\x1a\x07"sv, {"a RAR archive", kUnpack, true}},
    Signature{0,
              "\xfd"
              "7zXZ"sv,
              {"an xz archive", kUnpack, true}},
    Signature{0, "BZh"sv, {"a bzip2 archive", kUnpack, true}},
    Signature{0, "\x28\xb5\x2f\xfd"sv, {"a zstd archive", kUnpack, true}},
    Signature{257, "ustar"sv, {"a tar archive", kUnpack, true}},
    Signature{0, "GCDE"sv, {"binary G-code", "export the print as plain G-code"}},
    Signature{0, "\x89PNG"sv, {"a PNG", kPicture}},
    Signature{0, "\xff\xd8\xff"sv, {"a JPEG", kPicture}},
    Signature{0, "BM"sv, {"a BMP", kPicture}},
    Signature{0, "GIF8"sv, {"a GIF", kPicture}},
    Signature{8, "WEBP"sv, {"a WebP", kPicture}},
    Signature{0, "II*\0"sv, {"a TIFF or raw picture", kPicture}},
    Signature{0, "MM\0*"sv, {"a TIFF or raw picture", kPicture}},
    Signature{4, "ftypavif"sv, {"an AVIF", kPicture}},
    Signature{4, "ftyphei"sv, {"a HEIC", kPicture}},
    Signature{4, "ftyphev"sv, {"a HEIC", kPicture}},
    Signature{4, "ftypmif1"sv, {"a HEIC", kPicture}},
    Signature{4, "jP  \r\n"sv, {"a JPEG 2000", kPicture}},
    Signature{0, "\0\0\0\fJXL"sv, {"a JPEG XL", kPicture}},
    Signature{0, "\xff\x0a"sv, {"a JPEG XL", kPicture}},
    Signature{0, "%PDF"sv, {"a PDF", kOther}},
    Signature{0, "SQLite format 3"sv, {"an SQLite database", kOther}},
    Signature{0,
              "\x7f"
              "ELF"sv,
              {"a program", kOther}},
    Signature{0, "\xd0\xcf\x11\xe0"sv, {"an Office document", kOther}},
    Signature{
        0, "version https://git-lfs"sv, {"a pointer of Git LFS", "fetch the file that it names"}},
    Signature{0, "\xff\xfe\0\0"sv, {"text in UTF-32", "save it as UTF-8"}},
    Signature{0, "\xff\xfe"sv, {"text in UTF-16", "save it as UTF-8"}},
    Signature{0, "\xfe\xff"sv, {"text in UTF-16", "save it as UTF-8"}},
    Signature{0, "\0\0\xfe\xff"sv, {"text in UTF-32", "save it as UTF-8"}}};

// True if the bytes begin as an HTML page, in any case.
bool StartsAsPage(std::string_view bytes) {
  constexpr std::array kStarts = {"<!doctype html"sv, "<html"sv};
  bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
  return std::ranges::any_of(kStarts, [&bytes](std::string_view start) {
    return bytes.size() >= start.size() &&
           std::equal(start.begin(), start.end(), bytes.begin(), [](char a, char b) {
             return a == std::tolower(static_cast<unsigned char>(b));
           });
  });
}

}  // namespace

std::optional<FileKind> KindByContent(std::string_view bytes) {
  for (const Signature& signature : kSignatures) {
    if (bytes.size() > signature.at && bytes.substr(signature.at).starts_with(signature.with)) {
      return signature.kind;
    }
  }
  if (StartsAsPage(bytes)) return FileKind{"a web page", "download the file itself"};
  return std::nullopt;
}

}  // namespace trammel
