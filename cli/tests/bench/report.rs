//! The HTML report of `lexican conform` in a headless browser: what is shown and hidden, and that its script has no
//! errors.
#![cfg(unix)]

use std::path::Path;

use serde_json::json;

use crate::browser::{Browser, Page};
use crate::common::{folder, lexican_in};

/// The cases that fail.
const FAILED: &str = "306-1/6.5.2/2";
const KNOWN: &str = "306-1/6.5.2/8";

/// A report about a device with a value that differs from its data sheet, one failure of which is known. Its name needs
/// escaping in HTML.
fn report(folder: &Path) {
    let sheet = include_str!("../sensor.eds");
    let (name, samples) = ("ProductName=Sensor", "DefaultValue=5");
    assert!(sheet.contains(name) && sheet.contains(samples));
    let other = sheet.replace(name, "ProductName=<!--<script>{{report}}").replacen(samples, "DefaultValue=6", 1);
    std::fs::write(folder.join("sensor.eds"), sheet).unwrap();
    std::fs::write(folder.join("other.eds"), other).unwrap();
    std::fs::write(
        folder.join("known.toml"),
        format!("\"{KNOWN}\" = {{ seen = \"*\", why = \"as its manual says\" }}\n"),
    )
    .unwrap();
    let device = ["conform", "--bus", "sim:sensor.eds?node=7", "--device", "other.eds", "--known", "known.toml"];
    assert_eq!(lexican_in(folder, &[&device[..], &["--report", "report.html"]].concat()).code, Some(1));
}

/// The report after its script has run. The console must be empty, and nothing else loaded.
#[track_caller]
fn opens(browser: &Browser, folder: &Path, fragment: &str) -> Report {
    let window = browser.window();
    let address = format!("file://{}#{fragment}", folder.join("report.html").display());
    window.opens(&address);
    let dom = window.value("document.documentElement.outerHTML").as_str().unwrap().to_owned();
    assert_eq!((window.said(), window.requests().len()), (Vec::new(), 1), "{fragment}");
    Report { window, dom }
}

struct Report {
    window: Page,
    dom: String,
}

impl Report {
    /// The text after `from` and before `to`.
    #[track_caller]
    fn between(&self, from: &str, to: &str) -> &str {
        let (_, rest) = self.dom.split_once(from).unwrap_or_else(|| panic!("no {from}"));
        rest.split_once(to).unwrap_or_else(|| panic!("no {to} after {from}")).0
    }

    /// The cases, each with its tag and its content.
    fn cases(&self) -> impl Iterator<Item = (&str, &str)> {
        self.dom.split("<details ").skip(1).filter_map(|case| case.split_once("</details>")?.0.split_once('>'))
    }

    /// The ids of the cases that are shown.
    fn shown(&self) -> Vec<&str> {
        let shown = self.cases().filter(|(tag, _)| !tag.contains("hidden"));
        shown.filter_map(|(tag, _)| tag.split_once("data-id=\"")?.1.split('"').next()).collect()
    }

    fn frames(&self) -> usize {
        self.cases().map(|(_, content)| content.matches("<tr>").count()).sum()
    }
}

/// Does what a user does, step by step, and records the address after each step.
const USER: &str = r##"(async () => {
  const said = [];
  const then = async () => { await new Promise(done => setTimeout(done, 50)); said.push(decodeURIComponent(location.hash)); };
  const key = name => document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true }));
  const one = query => document.querySelector(query);
  one("button.known").click(); await then();
  one("button.passed").click(); await then();
  one("button.passed").click(); await then();
  one("#chapter").value = "306-1/6.5.2"; one("#chapter").dispatchEvent(new Event("change")); await then();
  key("/"); said.push(document.activeElement.id);
  one("#text").value = "scan may"; one("#text").dispatchEvent(new Event("input")); await then();
  key("ArrowDown"); said.push(document.activeElement.parentElement.dataset.id);
  document.activeElement.click(); await then();
  key("/"); key("Escape"); await then();
  one("#fold").click(); await then();
  one("#chapter").value = ""; one("#chapter").dispatchEvent(new Event("change")); one("button.known").click(); await then();
  return said;
})()"##;

#[test]
fn a_report_is_filtered_by_its_address_and_by_hand() {
    let folder = folder("conform-page");
    report(&folder);
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    for outside in ["http:", "https:", "src=", "url(", "@import", "<link"] {
        assert!(!page.contains(outside), "it loads something: {outside}");
    }
    let Some(browser) = Browser::start(&folder) else {
        eprintln!("skipped: no Chromium to open a report with: apt-get install chromium-headless-shell");
        return;
    };

    let all = opens(&browser, &folder, "");
    assert!(all.shown().len() > 127 && all.frames() == 0, "{} cases", all.shown().len());
    assert_eq!(all.between("<span id=\"device\">", "</span>"), "&lt;!--&lt;script&gt;{{report}}");
    assert_eq!(all.between("<p class=\"dim\" id=\"shown\" aria-live=\"polite\">", "</p>"), "");

    let failed = opens(&browser, &folder, "verdict=failed,known&open=306-1/6.5.2/8");
    assert_eq!(failed.shown(), [FAILED, KNOWN]);
    assert!(failed.dom.contains("known: as its manual says"));
    assert!(failed.frames() > 10, "those of one case are unfolded");
    assert!(failed.dom.contains("by default 6") && failed.dom.contains("aria-pressed=\"true\""));
    let count = failed.between("<p class=\"dim\" id=\"shown\" aria-live=\"polite\">", "</p>");
    assert_eq!(count, format!("2 of {} cases are shown", all.shown().len()));

    let toggles = opens(&browser, &folder, "verdict=passed,failed&text=Toggle");
    assert!(toggles.shown().contains(&"301/7.2.4.3.7/2") && toggles.shown().len() < 10, "{:?}", toggles.shown());
    let chapter = opens(&browser, &folder, "chapter=301/7.2.4");
    assert!(chapter.shown().len() > 20 && chapter.shown().iter().all(|id| id.starts_with("301/7.2.4.")));
    // A chapter of the plan, which is not in the list.
    let plan = opens(&browser, &folder, "chapter=8&verdict=not%20allowed");
    assert!(plan.shown().contains(&"301/7.5.2.13/1"), "{:?}", plan.shown());
    assert_eq!(opens(&browser, &folder, "text=%3Cnothing%3E").shown(), [""; 0]);

    let used = opens(&browser, &folder, "");
    let steps = [
        "#verdict=known",
        "#verdict=known,passed",
        "#verdict=known",
        "#verdict=known&chapter=306-1/6.5.2",
        "text",
        "#verdict=known&chapter=306-1/6.5.2&text=scan may",
        KNOWN,
        "#verdict=known&chapter=306-1/6.5.2&text=scan may&open=306-1/6.5.2/8",
        "#verdict=known&chapter=306-1/6.5.2&open=306-1/6.5.2/8",
        "#verdict=known&chapter=306-1/6.5.2",
        "",
    ];
    assert_eq!(used.window.value(USER), json!(steps));
    let used =
        Report { dom: used.window.value("document.documentElement.outerHTML").as_str().unwrap().to_owned(), ..used };
    assert_eq!((used.shown(), used.window.said()), (all.shown(), Vec::new()));
}
