"""Reads the Parquet tables with pyarrow and pandas, and compares them with the sessions they were made of.

    read_parquet.py TABLES BUNDLES
"""

import json
import pathlib
import sys

import pandas


def main(arguments):
    tables, bundles = map(pathlib.Path, arguments)
    sessions, metrics, events = (
        pandas.read_parquet(tables / f"{name}.parquet", engine="pyarrow") for name in ("sessions", "metrics", "events")
    )
    written = {path.parent.name: json.loads(path.read_text()) for path in bundles.glob("*/session.json")}
    assert len(sessions) == len(written) and sessions["session_id"].is_unique, sessions
    assert str(sessions["started_at"].dtype).startswith("datetime64") and "UTC" in str(sessions["started_at"].dtype)
    for _, row in sessions.iterrows():
        session = written[row["bundle"]]
        grade = session.get("grade")
        assert row["participant"] == session["participant"]
        assert row["points"] == grade["points"] and bool(row["passed"]) == grade["passed"] if grade else pandas.isna(row["points"])
        if grade:
            assert row["started_at"] == pandas.Timestamp(session["started"])
        own = metrics[metrics["session_id"] == row["session_id"]].set_index("metric")["value"]
        assert len(own) == len(session["metrics"])
        for name, value in session["metrics"].items():
            assert own[name] == value or value is None and pandas.isna(own[name]), name
        happened = events[events["session_id"] == row["session_id"]]
        answers = [answer for stage in session.get("stages", []) for answer in stage["answers"]]
        answered = happened[happened["event"] == "answered"]
        assert list(answered["at_s"]) == [answer["at_s"] for answer in answers]
        assert [None if pandas.isna(right) else bool(right) for right in answered["right"]] == [answer["right"] for answer in answers]
        rated = happened[happened["event"] == "rated"]
        items = session.get("questionnaire", {}).get("items", [])
        assert list(rated["number"]) == [item["value"] for item in items]
    # What analysis is for: a question over two tables.
    joined = metrics[metrics["metric"] == "decay_cleared_pct"].merge(sessions, on="session_id")
    mean = joined["value"].mean()
    values = [s["metrics"]["decay_cleared_pct"] for s in written.values() if s["metrics"].get("decay_cleared_pct")]
    assert abs(mean - sum(values) / len(values)) < 1e-9
    print(f"{len(sessions)} sessions, {len(metrics)} measures, {len(events)} events", file=sys.stderr)


if __name__ == "__main__":
    main(sys.argv[1:])
