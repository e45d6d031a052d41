"""The tables of docs/results.md from the folder of a suite, of what is finished: python docs/tables.py runs/paper"""

import json
import sys
import tomllib
from pathlib import Path

results = Path(sys.argv[1])
suite = tomllib.loads((results / "suite.toml").read_text())


def study(row):
    folder = results / row["scenario"]
    folder = folder / "variants" / row["variant"] if row.get("variant") else folder
    file = folder / "study.json"
    return json.loads(file.read_text()) if file.is_file() else None


def number(value, metric):
    if metric == "error_m":
        return f"{1000 * value:.1f}"
    if metric.endswith("_episodes"):
        return f"{100 * value:.1f} %"
    return "0.000" if metric != "reward/swaps" and abs(value) < 5e-4 else f"{1e6 * value:.2f}" if metric == "reward/swaps" else f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"


def cell(statistic, metric):
    text = number(statistic["iqm"], metric)
    if statistic["lo"] is not None:
        text += f" [{number(statistic['lo'], metric)}, {number(statistic['hi'], metric)}]"
    return text


UNITS = {"error_m": "distance, mm", "return": "return", "error_over_oracle": "distance, × oracle"}

for table in suite["table"]:
    methods = []
    rows = [(row, found) for row in table["row"] if (found := study(row))]
    if not rows:
        continue
    for row, found in rows:
        for method in found["protocols"][row["protocol"]]:
            if method not in methods:
                methods.append(method)
    first = ["mpg", "td3"]
    methods.sort(key=lambda method: (method not in first, method != "oracle", method))
    print(f"### {table['title']}\n\n{table['source']}\n")
    print("| | | published | " + " | ".join(methods) + " |\n|" + "---|" * (3 + len(methods)))
    for row, found in rows:
        metric = row["metric"]
        of = found["protocols"][row["protocol"]]
        cells = [cell(of[m][metric], metric) if m in of and metric in of[m] else "–" for m in methods]
        published = number(row["published"], metric) if "published" in row else "–"
        print(f"| {row['name']} | {UNITS.get(metric, metric)} | {published} | " + " | ".join(cells) + " |")
    print(f"\n{table['note'].strip()}\n" if table.get("note") else "")

print("### Claims\n\n| study | claim | holds | because |\n|---|---|---|---|")
seconds = 0.0
for file in sorted(results.glob("**/study.json")):
    found = json.loads(file.read_text())
    seconds += sum(sum(training["seconds_per_seed"]) for training in found["training"].values())
    for claim in found["expect"]:
        name = file.parent.relative_to(results)
        print(f"| {name} | `{claim['text']}` | {'yes' if claim['holds'] else '**no**'} | {claim['because']} |")
print(f"\nTraining took {seconds:.0f} s of one core in all.")
