// HTML page: its text, figures and style.
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

/// Returns the page up to <main>, with the style sheet and the heading. Plain text.
[[nodiscard]] std::string PageBegin(std::string_view title, std::string_view heading);
[[nodiscard]] std::string PageEnd();

/// Returns a section of the page. @param heading  plain text, may be empty. @param body  HTML.
[[nodiscard]] std::string Card(std::string_view heading, std::string_view body);
/// Returns the section with the answer, coloured by its verdict, which it names first.
/// @param words  replace the verdict's name if it covers several; plain text.
[[nodiscard]] std::string HeadCard(Verdict verdict, std::string_view body,
                                   std::string_view words = {});
/// Lists the unchecked assumptions of an answer, at the top of its head. Plain text.
[[nodiscard]] std::string UncheckedHtml(const std::vector<std::string>& unchecked);
/// Returns the answer's line: the value, and its interval in small letters. Plain text.
[[nodiscard]] std::string AnswerLine(std::string_view value, std::string_view interval);
/// Returns a table cell: a value with its interval below it in small letters. Plain text.
[[nodiscard]] std::string ValueCell(std::string_view value, std::string_view interval);
/// Returns a bulleted list; empty without lines. Plain text.
[[nodiscard]] std::string ListCard(std::string_view heading, const std::vector<std::string>& lines);
/// Returns a drawing, its narrow version on a phone.
[[nodiscard]] std::string DrawingHtml(const Figure& figure, const PhotoDetail& detail = {});
/// Returns a drawing with its caption below.
[[nodiscard]] std::string FigureHtml(const Figure& figure, const PhotoDetail& detail = {});

/// Levels of photo detail in a page, the finest first: each step takes about half of the bytes.
inline constexpr std::array<PhotoDetail, 5> kPhotoSteps = {
    {{1.5, 75}, {1.5, 50}, {1.0, 50}, {0.7, 50}, {0.45, 45}}};
inline constexpr std::size_t kMaxPageBytes = 1'500'000;

/// Makes a page at the finest of kPhotoSteps that yields at most kMaxPageBytes; at the coarsest if
/// none does. @param page  of an index into kPhotoSteps.
[[nodiscard]] std::string FittingPage(const std::function<std::string(std::size_t step)>& page);

/// Table whose rows become cards on a phone, so that no column is lost there.
class Table {
 public:
  struct Column {
    std::string name;    ///< plain text; may be empty
    bool words = false;  ///< true if left-aligned and wrapped
  };
  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// @param cells  HTML, as many as columns. @param unused  muted.
  void Row(const std::vector<std::string>& cells, bool unused = false);
  /// Adds a row across all columns. HTML.
  void Note(const std::string& html);
  [[nodiscard]] std::string Html() const;

 private:
  std::vector<Column> columns_;
  std::string rows_;
};

/// Escapes text and quoted attributes: & < > " ' become references; control characters and bytes
/// that are not UTF-8 become U+FFFD.
[[nodiscard]] std::string EscapeHtml(std::string_view text);

/// Encodes by RFC 4648 with padding.
[[nodiscard]] std::string Base64(std::string_view bytes);

}  // namespace trammel::report
