//! Events in, pictures out: what the window shows, and what it wants to show next.
//!
//! Input changes the camera at once and draws nothing. When the drawing thread is idle and the
//! window shows another view than is wanted, that view is begun: a burst of input costs one
//! picture, and no input costs none. A window that has to be filled again, because another one lay
//! over it, is filled with the picture that is there.
//!
//! When an array changes on the disk, the last picture stays and no other is drawn.

use std::{any::Any, collections::VecDeque, num::NonZeroU32, rc::Rc, sync::Arc};

use glam::{DVec2, DVec3};
use softbuffer::{Context, SoftBufferError, Surface};
use winit::{
    application::ApplicationHandler,
    dpi::PhysicalSize,
    event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent},
    event_loop::{ActiveEventLoop, EventLoopProxy, OwnedDisplayHandle},
    keyboard::ModifiersState,
    window::{Window, WindowId},
};

use super::{
    Ended, Shown, Start, ViewError,
    draw::{Drawn, Frame, Painter, arrays_changed, packed},
    guard,
    keys::{self, Command, KEYS},
    navigate,
    picture::Picture,
    screenshot::{self, Unsaved},
};
use planisphere_core::{
    camera::{Camera, ImageSize, MAX_SIDE, Projection, View},
    exact::decide::{Tally, Truth},
};
use planisphere_image::Paint;
use planisphere_renderer::Renderer;

/// What other threads send.
pub(super) enum Message {
    /// The drawing thread, for every view that it was given.
    Drawn(Drawn),
    /// The presenting thread, when it can do no more.
    #[cfg(all(unix, not(target_vendor = "apple")))]
    Trouble(super::x11::present::Trouble),
}

/// Notches of the wheel that double, or halve, what is seen.
const NOTCHES: f64 = 4.0;
/// Pixels of a touchpad's scrolling that are as much as a notch.
const NOTCH_PIXELS: f64 = 50.0;
/// Part of the screen, in tenths, that a window takes at most when it is opened.
const SCREEN_TENTHS: u32 = 9;

/// Where the window's pictures go.
enum Canvas {
    /// To the compositor or the system, at once.
    Soft(Surface<OwnedDisplayHandle, Rc<Window>>),
    /// To the thread that presents them on an X server.
    #[cfg(all(unix, not(target_vendor = "apple")))]
    X(super::x11::present::Presenter),
}

/// The X server that the window is on, and where its number there is put down.
#[cfg(all(unix, not(target_vendor = "apple")))]
type OnX = (Arc<super::x11::Server>, Arc<std::sync::atomic::AtomicU32>);

/// A drag that is under way.
struct Drag {
    button: MouseButton,
    pans: bool,
    /// The view, and the place of the cursor, that it is measured from.
    from: View,
    at: DVec2,
    /// The point that it is about.
    point: DVec3,
}

/// The window's state.
pub(super) struct App {
    start: Start,
    proxy: EventLoopProxy<Message>,
    #[cfg(all(unix, not(target_vendor = "apple")))]
    on_x: Option<OnX>,
    device: String,
    painter: Option<Painter>,
    window: Option<(Rc<Window>, Canvas)>,
    /// Size of the window.
    image: ImageSize,
    camera: Camera,
    /// The last point that was turned about, at first the scene's centre.
    pivot: DVec3,
    cursor: DVec2,
    modifiers: ModifiersState,
    drag: Option<Drag>,
    /// The camera after the last change of projection, and the one before: changing back is exact.
    switched: Option<(Camera, Camera)>,
    /// What the window shows.
    frame: Option<Arc<Frame>>,
    /// Which arrays have changed since, in words: nothing more is drawn.
    changed: Option<String>,
    /// Whether the drawing thread is busy.
    drawing: bool,
    /// Pictures drawn.
    drawn: u64,
    /// Screenshots that wait for their picture.
    screenshots: VecDeque<View>,
    /// Whether the title lists the keys.
    help: bool,
    failure: Option<ViewError>,
    panic: Option<Box<dyn Any + Send>>,
}

impl App {
    /// The state before there is a window. `proxy` is how other threads reach it.
    ///
    /// # Errors
    /// When there is no thread to draw with.
    pub fn new(
        start: Start,
        renderer: Renderer,
        proxy: EventLoopProxy<Message>,
    ) -> Result<Self, ViewError> {
        let words = renderer.device().to_owned();
        let to_app = proxy.clone();
        let done = move |drawn| {
            // An event loop that is gone wants no picture.
            let _ = to_app.send_event(Message::Drawn(drawn));
        };
        let loaded = start.loaded.clone();
        // What panics because an array has changed under it is reported as that change.
        guard::excuse(move || arrays_changed(&loaded).is_some());
        let painter = Painter::start(renderer, start.loaded.clone(), done)
            .map_err(|error| ViewError::Window(format!("no thread to draw with: {error}")))?;
        let image = start.image();
        let camera = start.loaded.camera(image);
        let mut app = Self {
            start,
            proxy,
            #[cfg(all(unix, not(target_vendor = "apple")))]
            on_x: None,
            device: words,
            painter: Some(painter),
            window: None,
            image,
            camera,
            pivot: DVec3::ZERO,
            cursor: DVec2::ZERO,
            modifiers: ModifiersState::empty(),
            drag: None,
            switched: None,
            frame: None,
            changed: None,
            drawing: false,
            drawn: 0,
            screenshots: VecDeque::new(),
            help: false,
            failure: None,
            panic: None,
        };
        app.pivot = app.center();
        Ok(app)
    }

    /// The same, with pictures that go to an X server; none leaves it as it is.
    #[cfg(all(unix, not(target_vendor = "apple")))]
    pub fn on_x(self, on_x: Option<OnX>) -> Self {
        Self { on_x, ..self }
    }

    /// Lets go of everything, and says how it ended.
    pub fn end(mut self) -> Ended {
        self.window = None;
        if !self.screenshots.is_empty() {
            (self.start.say)(
                "note: the window ended before the last screenshot was drawn; it was not saved",
            );
        }
        let drawing = self.painter.take().is_some_and(Painter::end);
        match (self.panic, self.failure) {
            (Some(payload), _) => Ended::Panicked(payload),
            (None, failure) => Ended::Shown(Shown { result: failure.map_or(Ok(()), Err), drawing }),
        }
    }

    /// The view that is wanted.
    fn view(&self) -> View {
        View::new(self.camera, self.image)
    }

    /// The camera that the scene begins with, in a window of the present size.
    fn home(&self) -> Camera {
        let Start { loaded, .. } = &self.start;
        match &loaded.fixed_camera {
            Some(camera) => navigate::resized(camera, self.start.image(), self.image),
            None => loaded.camera(self.image),
        }
    }

    /// The middle of the scene.
    fn center(&self) -> DVec3 {
        let bounds = self.start.loaded.scene.bounds();
        0.5 * bounds.min_center + 0.5 * bounds.max_center
    }

    /// A depth to work at: that of `point` if the camera can work with it, else a length of the
    /// scene's order.
    fn depth_of(&self, point: DVec3) -> f64 {
        let depth = navigate::depth(&self.camera, point);
        let usable = match self.camera.projection {
            Projection::Orthographic => depth.is_finite(),
            Projection::Perspective => depth.is_finite() && depth > 0.0,
        };
        if usable {
            return depth;
        }
        let bounds = self.start.loaded.scene.bounds();
        let reach =
            (0.5 * bounds.max_center - 0.5 * bounds.min_center).length() + bounds.max_radius;
        if reach.is_finite() && reach > 0.0 { reach } else { 1.0 }
    }

    /// The point of the scene that is seen below the cursor, in the picture that is shown.
    fn hit(&self) -> Option<DVec3> {
        let frame = self
            .frame
            .as_deref()
            .filter(|frame| frame.view.image == self.image && self.changed.is_none())?;
        let inside = |at: f64, side: u32| (at >= 0.0 && at < f64::from(side)).then_some(at as u32);
        let (column, row) =
            (inside(self.cursor.x, self.image.width)?, inside(self.cursor.y, self.image.height)?);
        let id = *frame.ids.get(row as usize * self.image.width as usize + column as usize)?;
        let scene = &self.start.loaded.scene;
        let sphere = scene.sphere(usize::try_from(id).ok()?)?;
        let truth = Truth::new(&frame.view, scene.bounds());
        let pixel = truth.pixel(column, row);
        let distance = pixel.distance(&pixel.hit(sphere.into(), &mut Tally::default())?);
        let sample = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
        Some(navigate::point(&frame.view, sample, distance)).filter(|point| point.is_finite())
    }

    /// The point that a gesture at the cursor is about: the scene below the cursor, or else
    /// `instead`. It is moved along the picture onto the cursor's ray, by less than a pixel unless
    /// the camera has moved since the picture was drawn.
    fn grasp(&self, instead: Option<DVec3>) -> DVec3 {
        match (self.hit(), instead) {
            (Some(hit), _) => navigate::point(&self.view(), self.cursor, self.depth_of(hit)),
            (None, Some(point)) => point,
            (None, None) => {
                navigate::point(&self.view(), self.cursor, self.depth_of(self.center()))
            }
        }
    }

    /// Takes a new camera. Where numbers run out of range there is none, and the old one stays.
    fn look(&mut self, camera: Camera) {
        if camera.check().is_ok() {
            self.camera = camera;
            self.update();
        }
    }

    /// Takes a new camera that no drag led to: a drag that is under way goes on from there.
    fn jump(&mut self, camera: Camera) {
        self.look(camera);
        let (view, cursor) = (self.view(), self.cursor);
        if let Some(drag) = &mut self.drag {
            (drag.from, drag.at) = (view, cursor);
        }
    }

    /// Begins the next picture if one is wanted, there can be one, and none is under way.
    fn update(&mut self) {
        if self.drawing || self.changed.is_some() || self.window.is_none() {
            return;
        }
        let wanted = self.screenshots.front().copied().unwrap_or_else(|| self.view());
        if self.frame.as_ref().is_some_and(|frame| frame.view == wanted) {
            return;
        }
        if let Some(painter) = &self.painter {
            painter.begin(wanted);
            self.drawing = true;
        }
    }

    /// Saves the screenshots whose picture is there.
    fn save(&mut self) {
        while let (Some(frame), Some(view)) = (&self.frame, self.screenshots.front())
            && frame.view == *view
        {
            let Start { loaded, name, say, .. } = &self.start;
            let paint = Paint { scene: &loaded.scene, background: loaded.look.behind() };
            match screenshot::save(name, view, &frame.ids, &paint, || arrays_changed(loaded)) {
                Ok(path) => {
                    say(&format!("saved {}", planisphere_core::text::name(path)));
                    self.print_camera(&screenshot::table(view, self.start.image()));
                }
                Err(Unsaved::Output(error)) => say(&format!("error: {error}")),
                Err(Unsaved::Changed(words)) => return self.freeze(words),
            }
            self.screenshots.pop_front();
        }
    }

    /// A camera is data, for standard output; where that takes none, it is not lost.
    fn print_camera(&self, table: &str) {
        let Start { say, print, .. } = &self.start;
        if let Err(error) = print(table) {
            say(&format!("error: standard output does not take the camera: {error}\n{table}"));
        }
    }

    /// Takes note that arrays have changed. The picture that is there stays; no other can be drawn.
    fn freeze(&mut self, words: String) {
        if self.changed.is_some() {
            return;
        }
        let say = self.start.say;
        say(&format!(
            "error: {words}\nthe window keeps its last picture; close it and view the scene again"
        ));
        if !self.screenshots.is_empty() {
            say("error: what the arrays were is gone, so that the screenshot was not saved");
            self.screenshots.clear();
        }
        self.changed = Some(words);
        self.retitle();
    }

    fn command(&mut self, command: Command, event_loop: &ActiveEventLoop) {
        match command {
            Command::Quit => event_loop.exit(),
            Command::Reset => {
                self.pivot = self.center();
                self.jump(self.home());
            }
            Command::Frame => {
                self.pivot = self.center();
                let mut camera = self.camera;
                camera.frame(self.start.loaded.scene.bounds(), self.image);
                self.jump(camera);
            }
            Command::Switch => match self.switched {
                Some((after, before)) if after == self.camera => self.jump(before),
                _ => {
                    let before = self.camera;
                    self.jump(navigate::switch(&self.view(), self.depth_of(self.pivot)));
                    self.switched = Some((self.camera, before));
                }
            },
            Command::Screenshot if self.changed.is_some() => {
                (self.start.say)(
                    "error: an array has changed since the scene was loaded; no screenshot was \
                     saved",
                );
            }
            Command::Screenshot => {
                self.screenshots.push_back(self.view());
                self.save();
                self.update();
            }
            Command::Help => (self.start.say)(&format!("keys:\n{KEYS}")),
        }
        // H shows the keys in the title too, until it is pressed again or another key is.
        self.help = command == Command::Help && !self.help;
        self.retitle();
    }

    fn button(&mut self, button: MouseButton, state: ElementState) {
        match (state, &self.drag) {
            (ElementState::Released, Some(drag)) if drag.button == button => self.drag = None,
            (ElementState::Pressed, None) => {
                let pans = match button {
                    MouseButton::Left => self.modifiers.shift_key(),
                    MouseButton::Middle => true,
                    _ => return,
                };
                let point = if pans {
                    self.grasp(None)
                } else {
                    self.pivot = self.grasp(Some(self.center()));
                    self.pivot
                };
                self.drag = Some(Drag { button, pans, from: self.view(), at: self.cursor, point });
            }
            _ => {}
        }
    }

    fn moved(&mut self, to: DVec2) {
        self.cursor = to;
        let Some(drag) = &self.drag else { return };
        let by = to - drag.at;
        self.look(if drag.pans {
            navigate::pan(&drag.from, navigate::depth(&drag.from.camera, drag.point), by)
        } else {
            navigate::orbit(&drag.from, drag.point, by, self.start.loaded.scene.bounds())
        });
    }

    fn wheel(&mut self, delta: MouseScrollDelta) {
        let notches = match delta {
            MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
            MouseScrollDelta::PixelDelta(by) => by.y / NOTCH_PIXELS,
        };
        if notches != 0.0 {
            let view = self.view();
            let depth = navigate::depth(&self.camera, self.grasp(None));
            self.jump(navigate::zoom(&view, self.cursor, depth, (-notches / NOTCHES).exp2()));
        }
    }

    fn resized(&mut self, size: PhysicalSize<u32>) {
        // A window without area is hidden: what it showed comes back with it.
        if size.width == 0 || size.height == 0 {
            return;
        }
        let to = ImageSize { width: size.width.min(MAX_SIDE), height: size.height.min(MAX_SIDE) };
        let camera = navigate::resized(&self.camera, self.image, to);
        self.image = to;
        self.jump(camera);
        self.retitle();
    }

    fn retitle(&self) {
        let Some((window, _)) = &self.window else { return };
        let name = planisphere_core::text::name(&self.start.name);
        let title = if self.help {
            format!("{name} | {}", keys::SHORT)
        } else if self.changed.is_some() {
            format!(
                "{name} | an array has changed on the disk: this is the last picture; close and \
                 view again"
            )
        } else {
            let spheres = self.start.loaded.scene.len();
            let ImageSize { width, height } = self.image;
            let milliseconds = self.frame.as_ref().map_or(0.0, |frame| frame.milliseconds);
            let (device, drawn) = (&self.device, self.drawn);
            format!(
                "{name} | {spheres} spheres | {width} x {height} | {device} | {milliseconds:.1} \
                 ms, picture {drawn} | H: keys"
            )
        };
        window.set_title(&title);
    }

    /// Puts the picture that is there into the window, in the middle while it has another size.
    fn present(&mut self) -> Result<(), SoftBufferError> {
        let Some((window, canvas)) = &mut self.window else { return Ok(()) };
        let background = packed(self.start.loaded.look.behind());
        let picture = Picture { frame: self.frame.clone(), size: self.image, background };
        window.pre_present_notify();
        match canvas {
            #[cfg(all(unix, not(target_vendor = "apple")))]
            Canvas::X(presenter) => presenter.show(picture),
            Canvas::Soft(surface) => {
                let ImageSize { width, height } = self.image;
                let (Some(columns), Some(rows)) = (NonZeroU32::new(width), NonZeroU32::new(height))
                else {
                    return Ok(());
                };
                surface.resize(columns, rows)?;
                let mut buffer = surface.buffer_mut()?;
                let mut room = Vec::new();
                for (y, row) in buffer.chunks_exact_mut(picture.columns()).enumerate() {
                    row.copy_from_slice(picture.row(y, &mut room));
                }
                buffer.present()?;
            }
        }
        Ok(())
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), String> {
        let [mut width, mut height] = self.start.size;
        let monitor =
            event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next());
        if let Some(screen) =
            monitor.map(|monitor| monitor.size()).filter(|size| size.width > 0 && size.height > 0)
        {
            let most = [screen.width, screen.height]
                .map(|side| f64::from((side / 10 * SCREEN_TENTHS).max(1)));
            let shrink = (most[0] / f64::from(width)).min(most[1] / f64::from(height));
            if shrink < 1.0 {
                [width, height] =
                    [width, height].map(|side| ((f64::from(side) * shrink) as u32).max(1));
            }
        }
        let attributes = Window::default_attributes()
            .with_title(self.start.name.to_string_lossy())
            .with_inner_size(PhysicalSize::new(width, height));
        let window =
            Rc::new(event_loop.create_window(attributes).map_err(|error| error.to_string())?);
        let size = window.inner_size();
        let canvas = self.canvas(event_loop, &window)?;
        self.window = Some((window, canvas));
        self.resized(size);
        self.update();
        Ok(())
    }

    fn canvas(&self, event_loop: &ActiveEventLoop, window: &Rc<Window>) -> Result<Canvas, String> {
        #[cfg(all(unix, not(target_vendor = "apple")))]
        if let Some((server, number)) = &self.on_x {
            use winit::raw_window_handle::{HasWindowHandle, RawWindowHandle};
            let handle = window.window_handle().map_err(|error| error.to_string())?.as_raw();
            let RawWindowHandle::Xlib(handle) = handle else {
                return Err(format!("it is no window of X: {handle:?}"));
            };
            // Numbers on an X server have 32 bits, whatever Xlib keeps them in.
            let id = handle.window as u32;
            number.store(id, std::sync::atomic::Ordering::Relaxed);
            let to_app = self.proxy.clone();
            let failed = move |trouble| drop(to_app.send_event(Message::Trouble(trouble)));
            let presenter = super::x11::present::Presenter::start(Arc::clone(server), id, failed);
            return presenter
                .map(Canvas::X)
                .map_err(|error| format!("no thread to present with: {error}"));
        }
        let context =
            Context::new(event_loop.owned_display_handle()).map_err(|error| error.to_string())?;
        Surface::new(&context, Rc::clone(window))
            .map(Canvas::Soft)
            .map_err(|error| error.to_string())
    }

    fn fail(&mut self, error: ViewError, event_loop: &ActiveEventLoop) {
        // The first counts: others follow from it.
        self.failure.get_or_insert(error);
        event_loop.exit();
    }
}

impl ApplicationHandler<Message> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none()
            && let Err(words) = self.open(event_loop)
        {
            self.fail(ViewError::Window(words), event_loop);
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, message: Message) {
        let drawn = match message {
            Message::Drawn(drawn) => drawn,
            #[cfg(all(unix, not(target_vendor = "apple")))]
            Message::Trouble(trouble) => return self.fail(trouble.into(), event_loop),
        };
        self.drawing = false;
        match drawn {
            Drawn::Frame(frame) => {
                self.drawn += 1;
                self.frame = Some(Arc::new(frame));
                self.save();
                self.update();
                self.retitle();
                if let Some((window, _)) = &self.window {
                    window.request_redraw();
                }
            }
            Drawn::Changed(words) => self.freeze(words),
            Drawn::Failed(error) => self.fail(error.into(), event_loop),
            Drawn::Panicked(payload) => {
                self.panic = Some(payload);
                event_loop.exit();
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            // By somebody else: at the end nothing is listened to any more.
            WindowEvent::Destroyed if self.window.is_some() => {
                self.fail(ViewError::Destroyed, event_loop)
            }
            WindowEvent::Resized(size) => self.resized(size),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.present() {
                    self.fail(ViewError::Window(error.to_string()), event_loop);
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.moved(DVec2::new(position.x, position.y))
            }
            WindowEvent::MouseInput { state, button, .. } => self.button(button, state),
            WindowEvent::MouseWheel { delta, .. } => self.wheel(delta),
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            // A key that was held down when the window got the keys was pressed for another one.
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => {
                // Together with these, keys belong to the desktop.
                let others = ModifiersState::CONTROL | ModifiersState::ALT | ModifiersState::SUPER;
                if !self.modifiers.intersects(others)
                    && let Some(command) = keys::command(&event)
                {
                    self.command(command, event_loop);
                }
            }
            _ => {}
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // Gone before a last picture is waited for.
        self.window = None;
    }
}
