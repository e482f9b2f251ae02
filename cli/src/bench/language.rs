//! The language of the page and the terminal.

use lexican_bench::tui;

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
pub(super) enum Language {
    /// German
    De,
    /// English
    En,
}

impl Language {
    /// The language in the user's environment.
    pub(super) fn of_this_user() -> Self {
        let named = |name| std::env::var(name).ok().filter(|locale| !locale.is_empty());
        let locale = ["LC_ALL", "LC_MESSAGES", "LANG"].into_iter().find_map(named);
        match tui::Language::of_locale(&locale.unwrap_or_default()) {
            tui::Language::German => Language::De,
            tui::Language::English => Language::En,
        }
    }

    /// The language tag in HTML.
    pub(super) const fn tag(self) -> &'static str {
        match self {
            Language::De => "de",
            Language::En => "en",
        }
    }
}

impl From<Language> for tui::Language {
    fn from(language: Language) -> Self {
        match language {
            Language::De => tui::Language::German,
            Language::En => tui::Language::English,
        }
    }
}
