// A page of HTML: its text, figures and style.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"
#include "document/figure.h"

namespace trammel::report {

/// To the opening of <main>, with the style sheet and the heading. Plain text.
[[nodiscard]] std::string PageBegin(std::string_view title, std::string_view heading);
[[nodiscard]] std::string PageEnd();

/// A section of the page. @param heading  plain text, may be empty. @param body  HTML.
[[nodiscard]] std::string Card(std::string_view heading, std::string_view body);
/// The section with the answer, coloured by its verdict, which it names first.
/// @param words  instead of the verdict's own, where it speaks of several; plain text.
[[nodiscard]] std::string HeadCard(Verdict verdict, std::string_view body,
                                   std::string_view words = {});
/// What an answer rests on and nothing checks: for its head, above the rest. Plain text.
[[nodiscard]] std::string UncheckedHtml(const std::vector<std::string>& unchecked);
/// The answer's line: what it is, in small letters its interval. Plain text.
[[nodiscard]] std::string AnswerLine(std::string_view value, std::string_view interval);
/// A value with its interval below it, in small letters: for a table's cell. Plain text.
[[nodiscard]] std::string ValueCell(std::string_view value, std::string_view interval);
/// Bullets; nothing without lines. Plain text.
[[nodiscard]] std::string ListCard(std::string_view heading, const std::vector<std::string>& lines);
/// A drawing, the narrow one on a phone.
[[nodiscard]] std::string DrawingHtml(const Figure& figure, const PhotoDetail& detail = {});
/// A drawing with its caption below.
[[nodiscard]] std::string FigureHtml(const Figure& figure, const PhotoDetail& detail = {});

/// How finely a page keeps its photos, from the finest: each step takes about half of the bytes.
inline constexpr std::array<PhotoDetail, 5> kPhotoSteps = {
    {{1.5, 75}, {1.5, 50}, {1.0, 50}, {0.7, 50}, {0.45, 45}}};
inline constexpr std::size_t kMostPageBytes = 1'500'000;

/// Makes a page at the finest of kPhotoSteps with which it has at most kMostPageBytes; at the
/// coarsest where none will do. @param page  of an index into kPhotoSteps.
[[nodiscard]] std::string FittingPage(const std::function<std::string(std::size_t step)>& page);

/// A table whose rows become cards on a phone, so that no column is lost there.
class Table {
 public:
  struct Column {
    std::string name;    ///< plain text; may be empty
    bool words = false;  ///< to the left, and broken where it is long
  };
  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// @param cells  HTML, as many as columns. @param unused  muted.
  void Row(const std::vector<std::string>& cells, bool unused = false);
  /// Across all columns. HTML.
  void Note(const std::string& html);
  [[nodiscard]] std::string Html() const;

 private:
  std::vector<Column> columns_;
  std::string rows_;
};

/// For text and for quoted attributes: & < > " ' become references, bytes that are not UTF-8 and
/// control characters U+FFFD.
[[nodiscard]] std::string EscapeHtml(std::string_view text);

/// RFC 4648 with padding.
[[nodiscard]] std::string Base64(std::string_view bytes);

}  // namespace trammel::report
