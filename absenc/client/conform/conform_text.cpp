// SPDX-License-Identifier: Apache-2.0
// Converts the results of a conformance test to text for people, to TAP, to JUnit XML and to JSON.
#include "absenc/client/conform/conform_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace absenc::client {

namespace {

constexpr std::string_view nothing_judged = "nothing was seen that could be judged";

// Returns why a conformance test did not succeed, apart from broken clauses; "" if there is no such reason.
std::string_view failure_of_all(const Conformance& one) {
  if (!one.left.empty()) return "the encoder is left changed";
  return one.verdict() == Verdict::untested ? nothing_judged : std::string_view();
}

std::string xml(std::string_view text) {
  std::string escaped;
  for (const char letter : text) {
    if (letter == '&') {
      escaped += "&amp;";
    } else if (letter == '<') {
      escaped += "&lt;";
    } else if (letter == '"') {
      escaped += "&quot;";
    } else {
      escaped += letter;
    }
  }
  return escaped;
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  if (verdict == Verdict::kept) return "kept";
  return verdict == Verdict::broken ? "broken" : "untested";
}

std::size_t Conformance::count(Verdict verdict) const {
  return static_cast<std::size_t>(
      std::count_if(clauses.begin(), clauses.end(), [&](const ClauseResult& one) { return one.verdict == verdict; }));
}

Verdict Conformance::verdict() const {
  if (!left.empty() || count(Verdict::broken) != 0) return Verdict::broken;
  return count(Verdict::kept) != 0 ? Verdict::kept : Verdict::untested;
}

std::string Conformance::tap() const {
  std::string text = fmt::format("TAP version 13\n1..{}\n", clauses.size());
  std::size_t number = 0;
  for (const ClauseResult& one : clauses) {
    text += fmt::format("{} {} - {}: {} ({}){}\n", one.verdict == Verdict::broken ? "not ok" : "ok", ++number, one.id,
                        one.words, one.paragraph,
                        one.verdict == Verdict::untested ? " # SKIP " + one.evidence : std::string());
    if (one.verdict == Verdict::broken) text += fmt::format("# {}\n", one.evidence);
  }
  for (const std::string& command : left) text += fmt::format("# left changed; to put it back: {}\n", command);
  if (const std::string_view why = failure_of_all(*this); !why.empty()) text += fmt::format("Bail out! {}\n", why);
  return text;
}

std::string Conformance::junit() const {
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  const std::string_view why = failure_of_all(*this);
  const std::size_t errors = why.empty() ? 0 : 1;
  text += fmt::format("<testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\">\n",
                      xml(protocol), clauses.size() + errors, count(Verdict::broken), errors, count(Verdict::untested));
  for (const ClauseResult& one : clauses) {
    text += fmt::format("  <testcase classname=\"{}\" name=\"{}: {} ({}, {})\">", xml(protocol), xml(one.id),
                        xml(one.words), xml(one.document), xml(one.paragraph));
    if (one.verdict == Verdict::broken) text += fmt::format("<failure message=\"{}\"/>", xml(one.evidence));
    if (one.verdict == Verdict::untested) text += fmt::format("<skipped message=\"{}\"/>", xml(one.evidence));
    text += "</testcase>\n";
  }
  if (errors != 0) {
    const std::string how = left.empty() ? "" : fmt::format("; to put it back: {}", fmt::join(left, "; "));
    text += fmt::format("  <testcase classname=\"{}\" name=\"all clauses\"><error message=\"{}{}\"/></testcase>\n",
                        xml(protocol), why, xml(how));
  }
  return text + "</testsuite>\n";
}

std::string Conformance::report() const {
  std::string text;
  for (const ClauseResult& one : clauses) {
    text += fmt::format("{}: {}: {}\n  {}, {}\n  {}\n", name_of(one.verdict), one.id, one.words, one.document,
                        one.paragraph, one.evidence);
  }
  if (!left.empty())
    text += fmt::format("the encoder is left changed; to put it back:\n  {}\n", fmt::join(left, "\n  "));
  text += fmt::format("{} kept, {} broken, {} untested\n", count(Verdict::kept), count(Verdict::broken),
                      count(Verdict::untested));
  return verdict() == Verdict::untested ? text + fmt::format("{}\n", nothing_judged) : text;
}

Json to_json(const Conformance& conformance) {
  const Json clauses = Json::list(conformance.clauses, [](const ClauseResult& one) {
    return Json::object()
        .set("id", one.id)
        .set("document", one.document)
        .set("paragraph", one.paragraph)
        .set("words", one.words)
        .set("verdict", name_of(one.verdict))
        .set("evidence", one.evidence);
  });
  return Json::object()
      .set("ok", conformance.verdict() == Verdict::kept)
      .set("protocol", conformance.protocol)
      .set("verdict", name_of(conformance.verdict()))
      .set("kept", conformance.count(Verdict::kept))
      .set("broken", conformance.count(Verdict::broken))
      .set("untested", conformance.count(Verdict::untested))
      .set("clauses", clauses)
      .set("left", Json::list(conformance.left));
}

}  // namespace absenc::client
