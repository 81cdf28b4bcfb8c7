#include "document/parsers_test_support.h"

#include <cairo.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "base/utf8.h"

namespace trammel::report::test {
namespace {

/// "quot;" … of a character reference right after its ampersand.
bool StartsReference(std::string_view text) {
  const std::size_t end = text.find(';');
  return end != std::string_view::npos && end >= 2 && end <= 8 &&
         text.find_first_not_of(
             "#abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789") == end;
}

}  // namespace

std::string XmlProblem(std::string_view text) {
  if (Utf8OrReplaced(text) != text) {
    return "not UTF-8, or a control character";
  }
  std::vector<std::string> open;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '&' && !StartsReference(text.substr(at + 1))) {
      return "loose & before " + std::string(text.substr(at, 30));
    }
    if (text[at] != '<') {
      continue;
    }
    const std::size_t end = text.find('>', at);
    if (end == std::string_view::npos) {
      return "a tag without end";
    }
    const std::string tag(text.substr(at + 1, end - at - 1));
    if (tag.empty() || tag.find('<') != std::string::npos) {
      return "loose < before " + std::string(text.substr(at, 30));
    }
    if (std::count(tag.begin(), tag.end(), '"') % 2 != 0) {
      return "a quote that does not close in <" + tag.substr(0, 80);
    }
    const std::string name = tag.substr(0, tag.find_first_of(" \n/", 1));
    if (tag[0] == '/') {
      if (open.empty() || "/" + open.back() != tag) {
        return "<" + tag + "> closes <" + (open.empty() ? "" : open.back()) + ">";
      }
      open.pop_back();
    } else if (tag[0] != '?' && tag[0] != '!' && tag.back() != '/') {
      open.push_back(name);
    }
    at = end;
  }
  return open.empty() ? "" : "<" + open.back() + "> does not close";
}

std::optional<PictureSize> DecodePng(std::string_view png) {
  const auto read = [](void* closure, unsigned char* data, unsigned int length) {
    auto& rest = *static_cast<std::string_view*>(closure);
    if (rest.size() < length) {
      return CAIRO_STATUS_READ_ERROR;
    }
    std::memcpy(data, rest.data(), length);
    rest.remove_prefix(length);
    return CAIRO_STATUS_SUCCESS;
  };
  std::string_view rest = png;
  cairo_surface_t* surface = cairo_image_surface_create_from_png_stream(read, &rest);
  std::optional<PictureSize> size;
  if (cairo_surface_status(surface) == CAIRO_STATUS_SUCCESS) {
    size = {cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface)};
  }
  cairo_surface_destroy(surface);
  return size;
}

}  // namespace trammel::report::test
