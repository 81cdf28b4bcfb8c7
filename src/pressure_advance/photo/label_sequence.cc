#include "pressure_advance/photo/label_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "base/check.h"

namespace trammel::pressure_advance {
namespace {

using vision::Homography;
using vision::LabelOffset;
using vision::LabelRow;
using vision::StrokeSum;
using vision::StrokeTable;

// Evenly spaced values, in microseconds: sums of decimal numbers stay exact.
struct Sequence {
  long start_us = 0, step_us = 0;
  double prior = 0;  // logarithm

  [[nodiscard]] double At_s(std::size_t candidate) const {
    return static_cast<double>(start_us + static_cast<long>(candidate) * step_us) * 1e-6;
  }
};

// Lists the sequences that people print: round steps from a round start.
std::vector<Sequence> LikelySequences(std::size_t candidates, bool few) {
  constexpr long kLongest_us = 4'000'000;
  // A narrow range far from 0 is hardly printed.
  constexpr double kUnusualStep = -3, kUnusualStart = -3, kStepsStart = -1.5, kNarrow = -8;
  constexpr long kFarStart = 4;
  std::vector<Sequence> sequences;
  for (const long decade : {100L, 1000L, 10000L, 100000L}) {
    for (const long percent : {100L, 120L, 125L, 150L, 175L, 200L, 225L, 250L, 300L, 350L, 400L,
                               450L, 500L, 600L, 700L, 750L, 800L, 900L}) {
      const long step = decade * percent / 100;
      const bool usual =
          percent == 100 || percent == 200 || percent == 400 || percent == 500 || percent == 250;
      if (few && !usual) continue;
      std::set<long> starts{0};
      for (long k = 1; k <= 40; ++k) starts.insert(k * step);
      for (long k = 1; k <= 200; ++k) {
        starts.insert(k * 1000);
        starts.insert(k * 5000);
        starts.insert(k * 10000);
      }
      if (few) starts = {0, 10000, 20000, 200000};
      for (const long start : starts) {
        if (start + static_cast<long>(candidates - 1) * step > kLongest_us) continue;
        const long range = static_cast<long>(candidates - 1) * step;
        const double prior = (usual ? 0 : kUnusualStep) +
                             (start == 0          ? 0
                              : start % step == 0 ? kStepsStart
                                                  : kUnusualStart) +
                             (start > kFarStart * range ? kNarrow : 0);
        sequences.push_back({start, step, prior});
      }
    }
  }
  return sequences;
}

// Texts of values in each format, made once.
class Texts {
 public:
  explicit Texts(const std::vector<LabelFormat>& formats)
      : formats_(formats), texts_(formats.size()) {}

  const std::string& Of(long value_us, std::size_t format) {
    auto [at, is_new] = texts_[format].try_emplace(value_us);
    if (is_new) at->second = formats_[format].TextOf(static_cast<double>(value_us) * 1e-6);
    return at->second;
  }

 private:
  const std::vector<LabelFormat>& formats_;
  std::vector<std::unordered_map<long, std::string>> texts_;
};

// Scores of sequences at one offset of the labels.
class Scorer {
 public:
  Scorer(StrokeTable table, const LabelPlaces& places)
      : table_(std::move(table)), labels_(places.photo_from_label.size()) {
    for (const LabelFormat& format : places.formats) sums_.push_back(table_.SumsOf(format.style));
  }

  double ScoreOf(const Sequence& sequence, std::size_t format, Texts& texts) const {
    StrokeSum total;
    for (std::size_t label = 0; label < labels_; ++label) {
      const long value_us = sequence.start_us + 2 * static_cast<long>(label) * sequence.step_us;
      sums_[format].Add(label, texts.Of(value_us, format), total);
    }
    return table_.LogLikelihood(total) + sequence.prior;
  }

  double ScoreOf(const std::vector<std::string>& texts, std::size_t format) const {
    StrokeSum total;
    for (std::size_t label = 0; label < texts.size(); ++label) {
      sums_[format].Add(label, texts[label], total);
    }
    return table_.LogLikelihood(total);
  }

 private:
  StrokeTable table_;
  std::size_t labels_;
  std::vector<vision::GlyphSums> sums_;  // per format
};

// Searches where the row as a whole lies, by the sequences that are printed most.
LabelOffset FindOffset(const LabelRow& row, const LabelPlaces& places, std::size_t candidates,
                       Texts& texts) {
  const std::vector<Sequence> few = LikelySequences(candidates, true);
  LabelOffset best;
  double best_score = -1;
  const auto look = [&](const LabelOffset& offset) {
    const Scorer scorer(row.TableAt(offset), places);
    for (std::size_t format = 0; format < places.formats.size(); ++format) {
      for (const Sequence& sequence : few) {
        const double score = scorer.ScoreOf(sequence, format, texts);
        if (score > best_score) {
          best_score = score;
          best = offset;
        }
      }
    }
  };
  constexpr double kCoarse_mm = 0.4, kUp_mm = 1.2;
  for (double along = -places.along_mm; along <= places.along_mm + 1e-9; along += kCoarse_mm) {
    for (double up = -kUp_mm; up <= kUp_mm + 1e-9; up += kCoarse_mm) look({along, up, 1});
  }
  const LabelOffset coarse = best;
  for (const double scale : {0.95, 0.975, 1.0, 1.025, 1.05}) {
    for (const double along : {-0.2, 0.0, 0.2}) {
      for (const double up : {-0.2, 0.0, 0.2}) {
        look({coarse.along_mm + along, coarse.up_mm + up, scale});
      }
    }
  }
  return best;
}

// Best sequence in one row of places, and the best of other values.
struct RowReading {
  Sequence best;
  std::size_t format = 0;
  double score = -1, next = -1;
  Sequence next_best;
  LabelOffset offset;
  std::vector<std::string> texts;
};

std::vector<std::string> TextsOf(const Sequence& sequence, const LabelFormat& format,
                                 std::size_t labels) {
  std::vector<std::string> texts;
  for (std::size_t label = 0; label < labels; ++label) {
    texts.push_back(format.TextOf(sequence.At_s(2 * label)));
  }
  return texts;
}

// Returns the labels of given values as the tool would print them.
std::vector<std::string> TextsOf(const std::vector<double>& values_s, const LabelFormat& format) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < values_s.size(); i += 2) texts.push_back(format.TextOf(values_s[i]));
  return texts;
}

bool Differ(const std::vector<std::string>& texts) {
  return std::adjacent_find(texts.begin(), texts.end()) == texts.end();
}

RowReading ReadRow(const LabelRow& row, const LabelPlaces& places, std::size_t candidates) {
  RowReading reading;
  Texts texts(places.formats);
  reading.offset = FindOffset(row, places, candidates, texts);
  const Scorer scorer(row.TableAt(reading.offset), places);
  for (const Sequence& sequence : LikelySequences(candidates, false)) {
    double score = -1;  // of the format that fits best
    std::size_t best_format = 0;
    for (std::size_t format = 0; format < places.formats.size(); ++format) {
      const double in_format = scorer.ScoreOf(sequence, format, texts);
      if (in_format <= std::max(score, reading.next)) continue;
      // Labels that do not differ show no step.
      if (!Differ(TextsOf(sequence, places.formats[format], row.size()))) continue;
      score = in_format;
      best_format = format;
    }
    if (score > reading.score) {
      reading.format = best_format;
      reading.next = reading.score;
      reading.next_best = reading.best;
      reading.score = score;
      reading.best = sequence;
    } else if (score > reading.next) {
      reading.next = score;
      reading.next_best = sequence;
    }
  }
  reading.texts = TextsOf(reading.best, places.formats[reading.format], row.size());
  return reading;
}

// True if one more digit would lie where the labels are looked at.
bool HasRoom(const std::string& text, const LabelPlaces& places, std::size_t format) {
  return vision::LengthOf_mm(text + '0', places.formats[format].style) <= places.longest_mm;
}

// Returns texts that differ from `text` by one digit, by one more, or by the last character.
std::vector<std::string> NeighboursOf(const std::string& text, bool has_room) {
  std::vector<std::string> neighbours;
  for (char digit = '0'; digit <= '9'; ++digit) {
    for (std::size_t at = 0; at < text.size(); ++at) {
      if (text[at] == '.' || text[at] == digit) continue;
      neighbours.push_back(text);
      neighbours.back()[at] = digit;
    }
    if (has_room) neighbours.push_back(text + digit);
  }
  if (text.size() > 1) neighbours.push_back(text.substr(0, text.size() - 1));
  return neighbours;
}

// Returns the largest score of the texts with one digit changed in all of them, or with all
// shorter.
double BestCommonChange(const Scorer& scorer, const std::vector<std::string>& texts,
                        const LabelPlaces& places, std::size_t format) {
  double best = -1;
  std::size_t longest = 0;
  for (const std::string& text : texts) longest = std::max(longest, text.size());
  const auto consider = [&](auto change) {
    std::vector<std::string> changed = texts;
    std::size_t count = 0;
    for (std::size_t label = 0; label < texts.size(); ++label) {
      change(changed[label]);
      count += changed[label] != texts[label];
    }
    if (2 * count > texts.size()) best = std::max(best, scorer.ScoreOf(changed, format));
  };
  for (std::size_t at = 0; at < longest; ++at) {
    consider([&](std::string& text) { text.resize(std::min(text.size(), at)); });
    for (char digit = '0'; digit <= '9'; ++digit) {
      consider([&](std::string& text) {
        if (at < text.size() && text[at] != '.') text[at] = digit;
      });
      consider([&](std::string& text) {
        if (at + 1 == text.size() && HasRoom(text, places, format)) text += digit;
      });
    }
  }
  return best;
}

// Returns why a sequence is not believed: digits that the photo shows better than those that the
// sequence has, or labels that are not seen. Values that are in no list of sequences fail here.
std::string Contradiction(const LabelRow& row, const LabelPlaces& places,
                          const RowReading& reading) {
  const Scorer scorer(row.TableAt(reading.offset), places);
  const std::size_t format = reading.format;
  const double whole = scorer.ScoreOf(reading.texts, format);
  constexpr double kBetter = 8;  // of one label: strokes may lack filament
  constexpr double kWorse = 5;   // of most labels
  std::size_t unseen = 0;
  for (std::size_t label = 0; label < reading.texts.size(); ++label) {
    std::vector<std::string> texts = reading.texts;
    texts[label].clear();
    const double blank = scorer.ScoreOf(texts, format);
    unseen += blank > whole;
    double best = kBetter + std::max(whole, blank);
    std::string better;
    const bool has_room = HasRoom(reading.texts[label], places, format);
    for (const std::string& neighbour : NeighboursOf(reading.texts[label], has_room)) {
      texts[label] = neighbour;
      const double score = scorer.ScoreOf(texts, format);
      if (score <= best) continue;
      best = score;
      better = neighbour;
    }
    if (!better.empty()) {
      return fmt::format("the label that should be {} looks like {}", reading.texts[label], better);
    }
  }
  if (BestCommonChange(scorer, reading.texts, places, format) > whole - kWorse) {
    return fmt::format("they are nearly {} to {}, but a digit may differ", reading.texts.front(),
                       reading.texts.back());
  }
  constexpr std::size_t kShown = 3;  // of this many, one may be hidden
  if (kShown * unseen <= reading.texts.size()) return {};
  return fmt::format("{} of {} labels are not seen", unseen, reading.texts.size());
}

// Best reading over all ways in which the labels may lie.
struct PhotoLabels {
  std::optional<RowReading> reading;
  std::optional<LabelRow> row;
  const LabelPlaces* places = nullptr;
  double rival = -1;    // score of the best other sequence, here or in another way
  std::string problem;  // without a reading
};

PhotoLabels SearchPlaces(const BgrView& photo, const std::vector<LabelPlaces>& all,
                         std::size_t candidates) {
  PhotoLabels labels;
  for (const LabelPlaces& places : all) {
    LabelRow row(photo, places.photo_from_label, places.longest_mm);
    constexpr double kFewest_px = 5;  // per mm: a bead of 2 px
    if (row.px_per_mm() < kFewest_px) {
      labels.problem = fmt::format("they have {:.1f} px per mm, fewer than {}: go nearer",
                                   row.px_per_mm(), kFewest_px);
      continue;
    }
    RowReading reading = ReadRow(row, places, candidates);
    labels.rival = std::max(labels.rival, reading.next);
    if (labels.reading && reading.score <= labels.reading->score) {
      labels.rival = std::max(labels.rival, reading.score);
      continue;
    }
    if (labels.reading) labels.rival = std::max(labels.rival, labels.reading->score);
    labels.reading = std::move(reading);
    labels.row = std::move(row);
    labels.places = &places;
  }
  return labels;
}

// True if the labels show given values about as well as those that were read.
bool MayBe(const PhotoLabels& labels, const std::vector<double>& given_s, double lead) {
  const Scorer scorer(labels.row->TableAt(labels.reading->offset), *labels.places);
  for (std::size_t format = 0; format < labels.places->formats.size(); ++format) {
    const double score = scorer.ScoreOf(TextsOf(given_s, labels.places->formats[format]), format);
    if (labels.reading->score - score < lead) return true;
  }
  return false;
}

std::string RangeText(const Sequence& sequence, std::size_t candidates) {
  return fmt::format("{:g} to {:g} s", sequence.At_s(0), sequence.At_s(candidates - 1));
}

}  // namespace

std::string LabelFormat::TextOf(double value_s) const {
  if (!rounded) return fmt::format("{:.{}g}", value_s, digits).substr(0, characters);
  const double scale = std::pow(10, digits);
  return fmt::format("{:.6g}", std::round(value_s * scale) / scale);
}

SequenceReading ReadSequence(const BgrView& photo, const std::vector<LabelPlaces>& all,
                             std::size_t candidates, const std::vector<double>& given_s) {
  TRAMMEL_CHECK(candidates >= 4, "{} candidates", candidates);
  // Tuned on virtual prints, seeds 310000 to 310999.
  constexpr double kLeastLead = 15;
  SequenceReading result;
  // OrcaSlicer prints 51 lines on a usual bed; memory grows with the number.
  constexpr std::size_t kMostCandidates = 120;
  if (candidates > kMostCandidates) {
    result.problem = fmt::format("{} lines are more than {}", candidates, kMostCandidates);
    return result;
  }
  const PhotoLabels labels = SearchPlaces(photo, all, candidates);
  result.problem = labels.problem;
  if (!labels.reading) return result;
  const RowReading& best = *labels.reading;
  result.score = best.score;
  result.lead = best.score - labels.rival;
  if (best.score < kLeastLabelScore) {
    result.problem = "none are seen";
    return result;
  }
  if (result.lead < kLeastLead) {
    result.problem =
        fmt::format("they may be those of {} as well as those of {}",
                    RangeText(best.best, candidates), RangeText(best.next_best, candidates));
    return result;
  }
  result.problem = Contradiction(*labels.row, *labels.places, best);
  if (!result.problem.empty()) return result;
  if (given_s.size() == candidates && MayBe(labels, given_s, kLeastLead)) {
    result.as_given = true;
    return result;
  }
  result.places = static_cast<std::size_t>(labels.places - all.data());
  for (std::size_t i = 0; i < candidates; ++i) {
    result.values_s.push_back(best.best.At_s(i));
  }
  return result;
}

}  // namespace trammel::pressure_advance
