//! The pages: HTML, style and script of each in one, joined when this is compiled. Nothing is loaded from elsewhere.

/// What stands before the style.
macro_rules! page {
    ([$($style:literal),*], $body:literal, [$($script:literal),*]) => {
        concat!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n",
            "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>Umbracast</title>\n",
            "<link rel=\"icon\" href=\"data:,\">\n<style>\n",
            $(include_str!(concat!("page/", $style)),)*
            "</style>\n</head>\n<body>\n",
            include_str!(concat!("page/", $body)),
            "<script>\n",
            $(include_str!(concat!("page/", $script)),)*
            "</script>\n</body>\n</html>\n"
        )
    };
}

/// Of `live` and `view`.
pub(super) const WATCH: &str = page!(
    ["style.css"],
    "watch.html",
    [
        "base.js",
        "gl.js",
        "flat.js",
        "camera.js",
        "hall.js",
        "people.js",
        "links.js",
        "scene.js",
        "board.js",
        "recording.js",
        "watch.js"
    ]
);

/// Of `plan`.
pub(super) const PLAN: &str = page!(
    ["style.css", "plan.css"],
    "plan.html",
    [
        "base.js",
        "gl.js",
        "flat.js",
        "camera.js",
        "hall.js",
        "people.js",
        "scene.js",
        "plan.js",
        "plan_draw.js"
    ]
);
