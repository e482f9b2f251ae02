//! The HTML report of `lexican conform` in a browser without a screen: what is shown and hidden, and that nothing is wrong
//! with its script.
#![cfg(unix)]

#[path = "common/mod.rs"]
mod common;

use std::path::Path;
use std::process::Command;

use common::{folder, lexican_in};

/// The cases that notice.
const FAILED: &str = "306-1/6.5.2/2";
const KNOWN: &str = "306-1/6.5.2/8";

/// Of a device with a value that is not that of its data sheet, as is known of one case. Its name is no HTML.
fn report(folder: &Path) {
    let sheet = include_str!("sensor.eds");
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
    let device = ["conform", "--bus", "sim:sensor.eds?node=7", "--eds", "other.eds", "--known", "known.toml"];
    assert_eq!(lexican_in(folder, &[&device[..], &["--html", "report.html"]].concat()).code, Some(1));
}

/// Headless Chromium, by one of its names.
struct Browser<'a> {
    program: &'static str,
    folder: &'a Path,
}

impl<'a> Browser<'a> {
    fn find(folder: &'a Path) -> Option<Self> {
        let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|run| run.status.success());
        let program = ["chromium-headless-shell", "chromium", "google-chrome"].into_iter().find(runs)?;
        Some(Browser { program, folder })
    }

    /// The page after its script has run. Nothing is said on its console, and nothing is loaded.
    #[track_caller]
    fn opens(&self, page: &str, fragment: &str) -> Page {
        let address = format!("file://{}#{fragment}", self.folder.join(page).display());
        let profile = format!("--user-data-dir={}", self.folder.join("profile").display());
        let run = Command::new("timeout")
            .args(["120", self.program, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr"])
            .args(["--virtual-time-budget=5000", "--dump-dom", &profile, &address])
            .output()
            .unwrap();
        let (dom, log) = (String::from_utf8(run.stdout).unwrap(), String::from_utf8_lossy(&run.stderr));
        let said: Vec<_> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
        assert!(run.status.success() && said.is_empty() && dom.contains("</html>"), "{fragment}: {said:?}\n{log}");
        Page { dom }
    }
}

struct Page {
    dom: String,
}

impl Page {
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

/// Does what a user does, one thing after the other, and notes in the title what the address says then.
const USER: &str = r##"<script>
addEventListener("load", async () => {
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
  document.title = said.join(" ; ");
});
</script></body>"##;

#[test]
fn a_report_is_filtered_by_its_address_and_by_hand() {
    let folder = folder("conform-page");
    report(&folder);
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    for outside in ["http:", "https:", "src=", "url(", "@import", "<link"] {
        assert!(!page.contains(outside), "it loads something: {outside}");
    }
    let Some(browser) = Browser::find(&folder) else {
        eprintln!("skipped: no Chromium to open a report with: apt-get install chromium-headless-shell");
        return;
    };

    let all = browser.opens("report.html", "");
    assert!(all.shown().len() > 127 && all.frames() == 0, "{} cases", all.shown().len());
    assert_eq!(all.between("<span id=\"device\">", "</span>"), "&lt;!--&lt;script&gt;{{report}}");
    assert_eq!(all.between("<p class=\"dim\" id=\"shown\" aria-live=\"polite\">", "</p>"), "");

    let failed = browser.opens("report.html", "verdict=failed,known&open=306-1/6.5.2/8");
    assert_eq!(failed.shown(), [FAILED, KNOWN]);
    assert!(failed.dom.contains("known: as its manual says"));
    assert!(failed.frames() > 10, "those of one case are unfolded");
    assert!(failed.dom.contains("by default 6") && failed.dom.contains("aria-pressed=\"true\""));
    let count = failed.between("<p class=\"dim\" id=\"shown\" aria-live=\"polite\">", "</p>");
    assert_eq!(count, format!("2 of {} cases are shown", all.shown().len()));

    let toggles = browser.opens("report.html", "verdict=passed,failed&text=Toggle");
    assert!(toggles.shown().contains(&"301/7.2.4.3.7/2") && toggles.shown().len() < 10, "{:?}", toggles.shown());
    let chapter = browser.opens("report.html", "chapter=301/7.2.4");
    assert!(chapter.shown().len() > 20 && chapter.shown().iter().all(|id| id.starts_with("301/7.2.4.")));
    // A chapter of the plan, which the list does not offer.
    let plan = browser.opens("report.html", "chapter=8&verdict=not%20allowed");
    assert!(plan.shown().contains(&"301/7.5.2.13/1"), "{:?}", plan.shown());
    assert_eq!(browser.opens("report.html", "text=%3Cnothing%3E").shown(), [""; 0]);

    std::fs::write(folder.join("used.html"), page.replace("</body>", USER)).unwrap();
    let used = browser.opens("used.html", "");
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
    assert_eq!(used.between("<title>", "</title>").replace("&amp;", "&"), steps.join(" ; "));
    assert_eq!(used.shown(), all.shown());
}
