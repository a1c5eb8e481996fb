//! Events in, pictures out: what the window shows, and what it wants to show next.
//!
//! Input changes the camera at once and draws nothing. When the drawing thread is idle and the window shows another view than
//! is wanted, that view is begun: a burst of input costs one picture, and no input costs none. A window that has to be filled
//! again, because another one lay over it, is filled with the picture that is there.

use std::{collections::VecDeque, num::NonZeroU32, rc::Rc};

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
    Start, ViewError,
    draw::{Frame, NoFrame, Painter, packed},
    keys::{self, Command, KEYS},
    navigate, screenshot,
};
use crate::{
    camera::{Camera, ImageSize, MAX_SIDE, Projection, View},
    exact::decide::{Tally, Truth},
    frame::Paint,
    load::ChangedFile,
    render::Device,
};

/// What the drawing thread sends.
pub(super) type Message = Result<Frame, NoFrame>;

/// Notches of the wheel that double, or halve, what is seen.
const NOTCHES: f64 = 4.0;
/// Pixels of a touchpad's scrolling that are as much as a notch.
const NOTCH_PIXELS: f64 = 50.0;
/// Part of the screen, in tenths, that a window takes at most when it is opened.
const SCREEN_TENTHS: u32 = 9;

type Canvas = Surface<OwnedDisplayHandle, Rc<Window>>;

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
    frame: Option<Frame>,
    /// Whether the drawing thread is busy.
    drawing: bool,
    /// Pictures drawn.
    drawn: u64,
    /// Screenshots that wait for their picture.
    screenshots: VecDeque<View>,
    /// Whether the title lists the keys.
    help: bool,
    failure: Option<ViewError>,
    /// A file of the scene that has changed: nothing more is drawn.
    changed: Option<ChangedFile>,
}

impl App {
    /// The state before there is a window. `proxy` is how the drawing thread reaches it.
    pub fn new(start: Start, device: Device, proxy: EventLoopProxy<Message>) -> Self {
        let words = device.description();
        let done = move |message| {
            // An event loop that is gone wants no picture.
            let _ = proxy.send_event(message);
        };
        let loaded = &start.loaded;
        let painter = Painter::start(device, loaded.scene.clone(), loaded.background, loaded.watch.clone(), done);
        let (image, camera) = (start.image, start.loaded.camera(start.image));
        let mut app = Self {
            start,
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
            drawing: false,
            drawn: 0,
            screenshots: VecDeque::new(),
            help: false,
            failure: None,
            changed: None,
        };
        app.pivot = app.center();
        app
    }

    /// Lets go of everything, and says how it ended.
    pub fn end(mut self) -> Result<(), ViewError> {
        self.window = None;
        if let Some(painter) = self.painter.take() {
            painter.end();
        }
        self.failure.map_or(Ok(()), Err)
    }

    /// The view that is wanted.
    fn view(&self) -> View {
        View::new(self.camera, self.image)
    }

    /// The camera that the scene begins with, in a window of the present size.
    fn home(&self) -> Camera {
        let Start { loaded, image, .. } = &self.start;
        match &loaded.fixed_camera {
            Some(camera) => navigate::resized(camera, *image, self.image),
            None => loaded.camera(self.image),
        }
    }

    /// The middle of the scene.
    fn center(&self) -> DVec3 {
        let bounds = self.start.loaded.scene.bounds();
        0.5 * bounds.min_center + 0.5 * bounds.max_center
    }

    /// A depth to work at: that of `point` if the camera can work with it, else a length of the scene's order.
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
        let reach = (0.5 * bounds.max_center - 0.5 * bounds.min_center).length() + bounds.max_radius;
        if reach.is_finite() && reach > 0.0 { reach } else { 1.0 }
    }

    /// The point of the scene that is seen below the cursor, in the picture that is shown.
    fn hit(&self) -> Option<DVec3> {
        let frame = self.frame.as_ref().filter(|frame| frame.view.image == self.image)?;
        let inside = |at: f64, side: u32| (at >= 0.0 && at < f64::from(side)).then_some(at as u32);
        let (column, row) = (inside(self.cursor.x, self.image.width)?, inside(self.cursor.y, self.image.height)?);
        let id = *frame.ids.get(row as usize * self.image.width as usize + column as usize)?;
        let scene = &self.start.loaded.scene;
        let sphere = scene.sphere(usize::try_from(id).ok()?)?;
        let truth = Truth::new(&frame.view, scene.bounds());
        let pixel = truth.pixel(column, row);
        let distance = || Some(pixel.distance(&pixel.hit(sphere.into(), &mut Tally::default())?));
        let distance = self.start.loaded.watch.guard(distance).ok()??;
        let sample = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
        Some(navigate::point(&frame.view, sample, distance)).filter(|point| point.is_finite())
    }

    /// The point that a gesture at the cursor is about: the scene below the cursor, or else `instead`. It is moved along
    /// the picture onto the cursor's ray, by less than a pixel unless the camera has moved since the picture was drawn.
    fn grasp(&self, instead: Option<DVec3>) -> DVec3 {
        match (self.hit(), instead) {
            (Some(hit), _) => navigate::point(&self.view(), self.cursor, self.depth_of(hit)),
            (None, Some(point)) => point,
            (None, None) => navigate::point(&self.view(), self.cursor, self.depth_of(self.center())),
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

    /// Begins the next picture if one is wanted and none is under way.
    fn update(&mut self) {
        if self.drawing || self.window.is_none() || self.changed.is_some() {
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
            let paint = Paint { scene: &loaded.scene, background: loaded.background };
            match screenshot::save(name, view, &frame.ids, &paint, &loaded.watch) {
                Ok(path) => {
                    let tables = screenshot::tables(&view.camera, view.image, loaded.background);
                    say(&format!("saved {}, whose view is\n\n{tables}", crate::text::name(path)));
                }
                Err(error) => say(&format!("error: {error}")),
            }
            self.screenshots.pop_front();
        }
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
            Command::Screenshot => {
                self.screenshots.push_back(self.view());
                self.save();
                self.update();
                if let (Some(changed), false) = (&self.changed, self.screenshots.is_empty()) {
                    // Nothing more is drawn.
                    (self.start.say)(&format!("error: {changed}"));
                    self.screenshots.clear();
                }
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
        let name = crate::text::name(&self.start.name);
        let title = if let Some(changed) = &self.changed {
            format!("{name} | {} changed; open it again", crate::text::name(&changed.path))
        } else if self.help {
            format!("{name} | {}", keys::SHORT)
        } else {
            let spheres = self.start.loaded.scene.len();
            let ImageSize { width, height } = self.image;
            let milliseconds = self.frame.as_ref().map_or(0.0, |frame| frame.milliseconds);
            let (device, drawn) = (&self.device, self.drawn);
            format!(
                "{name} | {spheres} spheres | {width} x {height} | {device} | {milliseconds:.1} ms, picture {drawn} | H: keys"
            )
        };
        window.set_title(&title);
    }

    /// Puts the picture that is there into the window, in the middle while it has another size.
    fn present(&mut self) -> Result<(), SoftBufferError> {
        let Some((window, canvas)) = &mut self.window else { return Ok(()) };
        let ImageSize { width, height } = self.image;
        let (Some(columns), Some(rows)) = (NonZeroU32::new(width), NonZeroU32::new(height)) else { return Ok(()) };
        canvas.resize(columns, rows)?;
        let mut buffer = canvas.buffer_mut()?;
        match &self.frame {
            Some(frame) if frame.view.image == self.image => buffer.copy_from_slice(&frame.pixels),
            other => {
                buffer.fill(packed(self.start.loaded.background));
                if let Some(frame) = other {
                    let (there, here) = (frame.view.image, self.image);
                    let (from_x, to_x, columns) = overlap(there.width, here.width);
                    let (from_y, to_y, rows) = overlap(there.height, here.height);
                    for row in 0..rows {
                        let from = (from_y + row) * there.width as usize + from_x;
                        let to = (to_y + row) * here.width as usize + to_x;
                        buffer[to..to + columns].copy_from_slice(&frame.pixels[from..from + columns]);
                    }
                }
            }
        }
        window.pre_present_notify();
        buffer.present()
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), String> {
        let ImageSize { mut width, mut height } = self.start.image;
        let monitor = event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next());
        if let Some(screen) = monitor.map(|monitor| monitor.size()).filter(|size| size.width > 0 && size.height > 0) {
            let most = [screen.width, screen.height].map(|side| f64::from(side / 10 * SCREEN_TENTHS));
            let shrink = (most[0] / f64::from(width)).min(most[1] / f64::from(height));
            if shrink < 1.0 {
                [width, height] = [width, height].map(|side| ((f64::from(side) * shrink) as u32).max(1));
            }
        }
        let attributes = Window::default_attributes()
            .with_title(self.start.name.to_string_lossy())
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Rc::new(event_loop.create_window(attributes).map_err(|error| error.to_string())?);
        let context = Context::new(event_loop.owned_display_handle()).map_err(|error| error.to_string())?;
        let canvas = Surface::new(&context, Rc::clone(&window)).map_err(|error| error.to_string())?;
        let size = window.inner_size();
        self.window = Some((window, canvas));
        self.resized(size);
        self.update();
        Ok(())
    }

    fn fail(&mut self, error: ViewError, event_loop: &ActiveEventLoop) {
        self.failure = Some(error);
        event_loop.exit();
    }
}

/// How many columns (or rows) of a picture go into a window when their middles fall together: the first column there, the
/// first here, and the number.
fn overlap(there: u32, here: u32) -> (usize, usize, usize) {
    let (there, here) = (there as usize, here as usize);
    (there.saturating_sub(here) / 2, here.saturating_sub(there) / 2, there.min(here))
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
        self.drawing = false;
        match message {
            Ok(frame) => {
                self.drawn += 1;
                self.frame = Some(frame);
                self.save();
                self.update();
                self.retitle();
                if let Some((window, _)) = &self.window {
                    window.request_redraw();
                }
            }
            Err(NoFrame::Draw(error)) => self.fail(error.into(), event_loop),
            Err(NoFrame::Changed(changed)) => {
                if self.changed.is_none() {
                    (self.start.say)(&format!(
                        "error: {changed}\nthe window keeps the last picture; open it again to go on"
                    ));
                }
                self.screenshots.clear();
                self.changed = Some(changed);
                self.retitle();
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => self.resized(size),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.present() {
                    self.fail(ViewError::Window(error.to_string()), event_loop);
                }
            }
            WindowEvent::CursorMoved { position, .. } => self.moved(DVec2::new(position.x, position.y)),
            WindowEvent::MouseInput { state, button, .. } => self.button(button, state),
            WindowEvent::MouseWheel { delta, .. } => self.wheel(delta),
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::KeyboardInput { event, .. } => {
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
